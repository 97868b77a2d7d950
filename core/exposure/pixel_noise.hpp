// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// Standard deviation of the noise of a pixel, from the median second difference along the rows of a sample of pixels:
/// edges are too few to move the median.
/// @param full  the level of a saturated pixel
/// @return      levels of the frame; 0 where it is too small to tell
/// @thread reentrant
[[nodiscard]] float pixel_noise(const GreyView& frame, double full);

}  // namespace slsd
