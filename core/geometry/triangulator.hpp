// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/geometry/pixel_ray.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {

struct TriangulationRig {
  RigidTransform projector_from_camera;
  Eigen::Array2d camera_focal_px, per_camera_focal, projector_focal_px;
};

/// Many camera rays, and what each meets: the numbers of each in a row.
struct RayMatches {
  PixelRays camera;                            ///< the pixels have no part
  PixelRays::Column projector_x, projector_y;  ///< directions
  PixelRays::Column sigma_px;                  ///< one standard deviation of the camera's pixel in x and in y

  void set(std::size_t i, const PixelRay& camera_ray, const Eigen::Vector2d& projector_direction,
           double camera_sigma_px) {
    camera.set(i, camera_ray);
    projector_x[i] = projector_direction.x(), projector_y[i] = projector_direction.y();
    sigma_px[i] = camera_sigma_px;
  }
};

/// triangulate() for many matches of one camera: the rays are given, the solution is in closed form.
/// @thread reentrant
class Triangulator {
 public:
  Triangulator(const CalibratedCamera& camera, const Lens& projector);

  /// Of the first of many matches.
  void triangulate(const RayMatches& matches, std::size_t count, TriangulatedPoint* points) const;
  /// @param camera_ray       of the camera's pixel: RayTable::ray() or pixel_ray()
  /// @param projector_ray    of the projector's pixel
  /// @param camera_sigma_px  one standard deviation of the camera's pixel in x and in y
  /// @return                 what triangulate() gives
  [[nodiscard]] TriangulatedPoint triangulate(const PixelRay& camera_ray, const PixelRay& projector_ray,
                                              double camera_sigma_px) const;

 private:
  TriangulationRig rig_;
};

}  // namespace slsd
