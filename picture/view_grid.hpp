// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// The border of a camera's image in the projector's, for a surface at one depth.
/// @param depth_mm  along the camera's axis, above 0
/// @param step_px   of the camera, from one place to the next along the border
/// @return          projector px, distorted, around the border and back to its beginning; without what lies behind the
///                  projector or so far outside its picture that its distortion says nothing
/// @thread reentrant
[[nodiscard]] std::vector<Eigen::Vector2d> outline_of_view(const Calibration& calibration,
                                                           const CalibratedCamera& camera, double depth_mm,
                                                           double step_px = 8);

/// A grid by which scanner and object are placed: lines over the projector's whole picture, and what each camera sees
/// at the nearest, the middle and the farthest depth, each named. Between the outlines lies what can be measured.
/// @param depth_min_mm, depth_max_mm  along the cameras' axes
/// @return of the projector's size
/// @thread reentrant
[[nodiscard]] Grey8 draw_view_grid(const Calibration& calibration, double depth_min_mm, double depth_max_mm);

}  // namespace slsd
