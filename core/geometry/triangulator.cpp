// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulator.hpp"

#include <cmath>
#include <limits>

namespace slsd {

Triangulator::Triangulator(const CalibratedCamera& camera, const Lens& projector)
    : projector_from_camera_(camera.projector_from_camera),
      camera_focal_px_(camera.lens.fx, camera.lens.fy),
      per_camera_focal_(1 / camera_focal_px_),
      projector_focal_px_(projector.fx, projector.fy) {}

// With d the camera's direction (x, y, 1), a point is P = z d + (u, v, 0), and the camera's rows of (34) leave the
// residuals w = (fx u, fy v). The projector's rows A read A P = q z + L w = b. What minimises |w|^2 + |q z + L w - b|^2
// for a given z is w = L' S (b - q z) with S = (I + L L')^-1, two by two; and then
//
//     z = q'S b / q'S q
//
// The slope along the ray for a pixel's move follows from (37), differentiated: it takes the solution of the same
// normal equations for d on their right-hand side, here `pull`, found in the same way.
TriangulatedPoint Triangulator::triangulate(const PixelRay& camera_ray, const PixelRay& projector_ray,
                                            double camera_sigma_px) const {
  const auto& [rotation, translation] = projector_from_camera_;
  const Eigen::Vector2d seen = camera_ray.direction, lit = projector_ray.direction;
  const Eigen::RowVector3d a0 = projector_focal_px_.x() * (lit.x() * rotation.row(2) - rotation.row(0)),
                           a1 = projector_focal_px_.y() * (lit.y() * rotation.row(2) - rotation.row(1));
  const Eigen::Vector2d b(projector_focal_px_.x() * (translation.x() - lit.x() * translation.z()),
                          projector_focal_px_.y() * (translation.y() - lit.y() * translation.z()));
  const Eigen::Vector2d q(a0.x() * seen.x() + a0.y() * seen.y() + a0.z(),
                          a1.x() * seen.x() + a1.y() * seen.y() + a1.z());
  Eigen::Matrix2d l;
  l << a0.x() * per_camera_focal_.x(), a0.y() * per_camera_focal_.y(), a1.x() * per_camera_focal_.x(),
      a1.y() * per_camera_focal_.y();

  const double s00 = 1 + l.row(0).squaredNorm(), s11 = 1 + l.row(1).squaredNorm(), s01 = l.row(0).dot(l.row(1));
  Eigen::Matrix2d s;
  s << s11, -s01, -s01, s00;
  s *= 1 / (s00 * s11 - s01 * s01);
  const Eigen::Vector2d sq = s * q;
  const double per_qsq = 1 / q.dot(sq);

  const double z = b.dot(sq) * per_qsq;
  const Eigen::Vector2d w = l.transpose() * (s * (b - q * z));
  const Eigen::Vector2d off_ray = (w.array() * per_camera_focal_).matrix();
  Eigen::Vector3d point(seen.x() * z + off_ray.x(), seen.y() * z + off_ray.y(), z);

  const double length_squared = 1 + seen.squaredNorm();
  const Eigen::Vector2d e = (seen.array() * per_camera_focal_).matrix(), le = l * e;
  const double pull_z = (length_squared - sq.dot(le)) * per_qsq;
  const Eigen::Vector2d pull_w = e - l.transpose() * (s * le + sq * pull_z);
  const Eigen::RowVector2d slope = (-camera_focal_px_ * (z * pull_w + pull_z * w).array()).matrix().transpose();
  const double slope_mm_per_px = std::sqrt((slope * camera_ray.turn).squaredNorm() / length_squared);

  const bool in_front = rotation.row(2).dot(point) + translation.z() > 0;
  if (!in_front) point.setConstant(std::numeric_limits<double>::quiet_NaN());
  return {point, camera_sigma_px * slope_mm_per_px};
}

}  // namespace slsd
