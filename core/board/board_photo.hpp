// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// An image in the two forms that boards are looked for in.
struct BoardPhoto {
  Image<float> light;  ///< levels of the image itself, to measure in
  Grey8 grey;          ///< stretched from its darkest to its brightest hundredth, to search in
  double full = 255;   ///< level of a saturated pixel
};

/// @thread reentrant
[[nodiscard]] BoardPhoto photograph(const GreyView& image);

/// Left for right.
/// @thread reentrant
[[nodiscard]] Grey8 mirrored(const Grey8& image);

}  // namespace slsd
