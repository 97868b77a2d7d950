// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

/// The border of a camera's image in projector pixels, for a surface at one depth.
/// @param depth_mm  along the camera's axis, above 0
/// @param step_px   distance of neighbouring points along the border, camera px
/// @return          projector px, distorted, once around the border and closed; without points behind the projector, or
///                  so far outside its picture that its distortion model does not apply
/// @thread reentrant
[[nodiscard]] std::vector<Eigen::Vector2d> outline_of_view(const Calibration& calibration,
                                                           const CalibratedCamera& camera, double depth_mm,
                                                           double step_px = 8);

/// A grid for placing scanner and object: lines over the projector's whole picture, and the named outlines of each
/// camera's view at the nearest, middle and farthest depth. The measurable region lies between the outlines.
/// @param depth_min_mm, depth_max_mm  along the cameras' axes
/// @return in the projector's size
/// @thread reentrant
[[nodiscard]] Grey8 draw_view_grid(const Calibration& calibration, double depth_min_mm, double depth_max_mm);

}  // namespace slsd
