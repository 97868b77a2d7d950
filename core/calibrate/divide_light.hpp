// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The pattern's image divided by the white one: what is printed on a surface, and how the light falls on it, goes out;
/// what is left is the pattern. Where the white image is dark there is nothing to see, and the quotient is 0.
/// @param pattern  of the same size and depth as white
/// @return 16 bits; 50000 where the pattern is as bright as white
/// @errors kMismatch: the images are not of the same size
/// @thread reentrant
[[nodiscard]] Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white);

}  // namespace slsd
