// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// A camera pixel and the projector pixel that lit it; distorted, as observed.
struct Match {
  Eigen::Vector2d camera_px;
  Eigen::Vector2d projector_px;
};

struct TriangulatedPoint {
  Eigen::Vector3d point_in_camera;  ///< mm
  double sigma_mm;                  ///< one standard deviation along the camera's ray
};

/// Intersects camera and projector rays in the least-squares sense, after undistorting both pixels. Elahi et al. 2020,
/// equations (34) to (37). This is the plain form: class Triangulator computes the same faster.
/// @param camera_sigma_px  one standard deviation of the camera pixel in x and in y; the projector pixel is exact
/// @return if the rays do not meet in front of both devices, z <= 0 (behind the camera) or not finite
/// @thread reentrant
[[nodiscard]] TriangulatedPoint triangulate(const Match& match, const CalibratedCamera& camera, const Lens& projector,
                                            double camera_sigma_px);

/// Signed distance of the projector pixel from the epipolar line of the camera pixel, projector px. It is positive on
/// the same side of the lines for all pixels on the same side of the epipole.
/// @thread reentrant
[[nodiscard]] double signed_epipolar_residual_px(const Match& match, const CalibratedCamera& camera,
                                                 const Lens& projector);

/// The absolute value of the same.
/// @thread reentrant
[[nodiscard]] double epipolar_residual_px(const Match& match, const CalibratedCamera& camera, const Lens& projector);

}  // namespace slsd
