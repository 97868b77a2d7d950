// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/pixel_ray.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {

/// Constants of a rig from which points are computed.
struct TriangulationRig {
  RigidTransform projector_from_camera;
  Eigen::Array2d camera_focal_px, per_camera_focal_px, projector_focal_px;
};

/// Matches of up to PixelRays::kAtOnce camera rays, one column for each component.
struct RayMatches {
  PixelRays camera;                            ///< the pixels are not used
  PixelRays::Column projector_x, projector_y;  ///< directions
  PixelRays::Column sigma_px;                  ///< one standard deviation of the camera's pixel in x and in y

  void set(std::size_t i, const PixelRay& camera_ray, const Eigen::Vector2d& projector_direction,
           double camera_sigma_px) {
    camera.set(i, camera_ray);
    projector_x[i] = projector_direction.x(), projector_y[i] = projector_direction.y();
    sigma_px[i] = camera_sigma_px;
  }
};

/// triangulate() for many matches of one camera, in closed form from given rays.
/// @thread reentrant
class Triangulator {
 public:
  Triangulator(const CalibratedCamera& camera, const Lens& projector);

  /// @param points  becomes the result of triangulate() for each match, up to its size: camera frame, mm; NaN behind
  ///                the projector
  void triangulate(const RayMatches& matches, std::span<TriangulatedPoint> points) const;

 private:
  TriangulationRig rig_;
};

}  // namespace slsd
