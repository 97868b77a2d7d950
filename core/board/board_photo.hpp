// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// An image in the two forms in which boards are searched.
struct BoardPhoto {
  Image<float> light;  ///< levels of the image itself, for measuring
  Grey8 grey;          ///< stretched from its darkest to its brightest hundredth, for searching
  double full = 255;   ///< level of a saturated pixel
};

/// @thread reentrant
[[nodiscard]] BoardPhoto photograph(const GreyView& image);

/// Mirrors left and right.
/// @thread reentrant
[[nodiscard]] Grey8 mirrored(const Grey8& image);

}  // namespace slsd
