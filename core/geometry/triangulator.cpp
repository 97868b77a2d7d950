// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulator.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slsd {

Triangulator::Triangulator(const CalibratedCamera& camera, const Lens& projector)
    : projector_from_camera_(camera.projector_from_camera),
      camera_focal_px_(camera.lens.fx, camera.lens.fy),
      projector_focal_px_(projector.fx, projector.fy) {}

TriangulatedPoint Triangulator::triangulate(const PixelRay& camera_ray, const PixelRay& projector_ray,
                                            double camera_sigma_px) const {
  const auto& [rotation, translation] = projector_from_camera_;
  const Eigen::Vector2d& seen = camera_ray.direction;
  const Eigen::Vector2d& lit = projector_ray.direction;

  // Rows of A and b, equations (34) to (36), the principal points taken out.
  const Eigen::Vector3d row0 = camera_focal_px_.x() * Eigen::Vector3d(-1, 0, seen.x());
  const Eigen::Vector3d row1 = camera_focal_px_.y() * Eigen::Vector3d(0, -1, seen.y());
  const Eigen::Vector3d row2 = projector_focal_px_.x() * (lit.x() * rotation.row(2) - rotation.row(0));
  const Eigen::Vector3d row3 = projector_focal_px_.y() * (lit.y() * rotation.row(2) - rotation.row(1));
  const double b2 = projector_focal_px_.x() * (translation.x() - lit.x() * translation.z());
  const double b3 = projector_focal_px_.y() * (translation.y() - lit.y() * translation.z());

  // (37): (A'A)^-1 A'b
  const Eigen::Matrix3d normal =
      row0 * row0.transpose() + row1 * row1.transpose() + row2 * row2.transpose() + row3 * row3.transpose();
  const Eigen::Matrix3d inverse = normal.inverse();
  Eigen::Vector3d point = inverse * (b2 * row2 + b3 * row3);

  // How far the point moves along the ray as the ray turns, from differentiating the normal equations.
  const Eigen::Vector3d pull = inverse * seen.homogeneous() / std::sqrt(1 + seen.squaredNorm());
  const Eigen::RowVector2d slope(camera_focal_px_.x() * (point.z() * pull.dot(row0) + pull.z() * row0.dot(point)),
                                 camera_focal_px_.y() * (point.z() * pull.dot(row1) + pull.z() * row1.dot(point)));

  const Eigen::Vector3d turned = rotation * seen.homogeneous();
  const Eigen::Vector3d line = translation.cross(turned);
  const double offset = std::abs(line.dot(lit.homogeneous()));
  const bool in_front = rotation.row(2).dot(point) + translation.z() > 0;
  if (!in_front) point.setConstant(std::numeric_limits<double>::quiet_NaN());
  return {point, camera_sigma_px * (slope * camera_ray.turn).norm(),
          offset / (projector_ray.turn.transpose() * line.head<2>()).norm()};
}

}  // namespace slsd
