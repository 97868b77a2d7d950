// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// A camera pixel and the projector pixel that lit it; distorted, as seen.
struct Match {
  Eigen::Vector2d camera_px;
  Eigen::Vector2d projector_px;
};

struct TriangulatedPoint {
  Eigen::Vector3d point_in_camera;  ///< mm
  double sigma_mm;                  ///< one standard deviation along the camera's ray
};

/// Intersects camera and projector rays in the least-squares sense, both pixels undistorted first.
/// Elahi et al. 2020, equations (34) to (37). The plain form: class Triangulator gives the same, faster.
/// @param camera_sigma_px  one standard deviation of the camera pixel in x and in y; the projector pixel is exact
/// @return a point with z <= 0 (behind the camera) or not finite where the rays do not meet in front of both
/// @thread reentrant
[[nodiscard]] TriangulatedPoint triangulate(const Match& match, const CalibratedCamera& camera, const Lens& projector,
                                            double camera_sigma_px);

/// Distance of the projector pixel from the epipolar line of the camera pixel, in projector px; signed: positive on the
/// same side of the lines for all pixels that are on the same side of the epipole.
/// @thread reentrant
[[nodiscard]] double signed_epipolar_residual_px(const Match& match, const CalibratedCamera& camera,
                                                 const Lens& projector);

/// The same without its sign.
/// @thread reentrant
[[nodiscard]] double epipolar_residual_px(const Match& match, const CalibratedCamera& camera, const Lens& projector);

}  // namespace slsd
