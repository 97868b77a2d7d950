// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// What others would make of the same frame and the same decoded symbols: a depth to a camera pixel, NaN where none.
using DepthMap = std::vector<float>;

/// OpenCV's semi-global matching between the rectified frame and the projector's image, seen as a second camera's. It
/// is given the range of depths that the symbols have.
[[nodiscard]] DepthMap match_semi_global(const GreyView& frame, double full, const Pattern& pattern,
                                         const Calibration& calibration, std::span<const CloudPoint> points);

/// The symbols' centres joined by triangles, but for those that are larger than any between neighbours.
[[nodiscard]] DepthMap join_by_triangles(const Pattern& pattern, const Calibration& calibration,
                                         std::span<const CloudPoint> points);

}  // namespace slsd
