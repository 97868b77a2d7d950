// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// Colour of a depth: gold is near, indigo far; lightness falls steadily, so that it also reads without colour.
/// @param share  0 near to 1 far; clamped
/// @thread reentrant
[[nodiscard]] Rgb depth_colour(double share);

}  // namespace slsd
