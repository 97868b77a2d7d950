// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/geometry/pixel_ray.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {

/// triangulate() for many matches of one camera: the rays are given, the solution is in closed form.
/// @thread reentrant
class Triangulator {
 public:
  Triangulator(const CalibratedCamera& camera, const Lens& projector);

  /// @param camera_ray       of the camera's pixel: RayTable::ray() or pixel_ray()
  /// @param projector_ray    of the projector's pixel
  /// @param camera_sigma_px  one standard deviation of the camera's pixel in x and in y
  /// @return                 what triangulate() gives
  [[nodiscard]] TriangulatedPoint triangulate(const PixelRay& camera_ray, const PixelRay& projector_ray,
                                              double camera_sigma_px) const;

 private:
  RigidTransform projector_from_camera_;
  Eigen::Array2d camera_focal_px_;
  Eigen::Array2d per_camera_focal_;
  Eigen::Array2d projector_focal_px_;
};

}  // namespace slsd
