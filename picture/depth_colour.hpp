// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// The colour of a depth: gold is near, indigo far. Lightness falls steadily, so the scale is readable without colour.
/// @param share  0 near to 1 far; clamped
/// @thread reentrant
[[nodiscard]] Rgb depth_colour(double share);

}  // namespace slsd
