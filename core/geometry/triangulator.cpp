// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulator.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace slsd {
namespace {

// Rows of A and b, equations (34) to (36), the principal points taken out.
struct Rows {
  Eigen::Vector3d seen_x, seen_y, lit_x, lit_y;
  double b_x, b_y;  // of the projector; the camera's are zero
};

Rows rows_of(const Eigen::Vector2d& seen, const Eigen::Vector2d& lit, const RigidTransform& motion,
             const Eigen::Array2d& camera_focal_px, const Eigen::Array2d& projector_focal_px) {
  const auto& [rotation, translation] = motion;
  return {camera_focal_px.x() * Eigen::Vector3d(-1, 0, seen.x()),
          camera_focal_px.y() * Eigen::Vector3d(0, -1, seen.y()),
          projector_focal_px.x() * (lit.x() * rotation.row(2) - rotation.row(0)),
          projector_focal_px.y() * (lit.y() * rotation.row(2) - rotation.row(1)),
          projector_focal_px.x() * (translation.x() - lit.x() * translation.z()),
          projector_focal_px.y() * (translation.y() - lit.y() * translation.z())};
}

// A'A
Eigen::Matrix3d normal_matrix(const Rows& rows) {
  return rows.seen_x * rows.seen_x.transpose() + rows.seen_y * rows.seen_y.transpose() +
         rows.lit_x * rows.lit_x.transpose() + rows.lit_y * rows.lit_y.transpose();
}

// For a symmetric matrix: half the work of Eigen's inverse.
Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& m) {
  const double xx = m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2);
  const double xy = m(0, 2) * m(1, 2) - m(0, 1) * m(2, 2);
  const double xz = m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1);
  const double yy = m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2);
  const double yz = m(0, 1) * m(0, 2) - m(0, 0) * m(1, 2);
  const double zz = m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1);
  const double scale = 1.0 / (m(0, 0) * xx + m(0, 1) * xy + m(0, 2) * xz);
  Eigen::Matrix3d inverse;
  inverse << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return scale * inverse;
}

// How far the point moves along the camera's ray for a pixel's move in the steepest direction, mm per px: the normal
// equations, differentiated.
double slope_mm_per_px(const Rows& rows, const Eigen::Matrix3d& inverse, const Eigen::Vector3d& point,
                       const PixelRay& ray, const Eigen::Array2d& focal_px) {
  const Eigen::Vector3d pull = inverse * ray.direction.homogeneous();
  const Eigen::RowVector2d slope(
      focal_px.x() * (point.z() * pull.dot(rows.seen_x) + pull.z() * rows.seen_x.dot(point)),
      focal_px.y() * (point.z() * pull.dot(rows.seen_y) + pull.z() * rows.seen_y.dot(point)));
  return std::sqrt((slope * ray.turn).squaredNorm() / (1 + ray.direction.squaredNorm()));
}

double epipolar_residual_px(const Eigen::Vector2d& seen, const PixelRay& projector_ray, const RigidTransform& motion) {
  const Eigen::Vector3d line = motion.translation.cross(motion.rotation * seen.homogeneous());
  const Eigen::Vector2d slope_per_px = projector_ray.turn.transpose() * line.head<2>();
  return std::abs(line.dot(projector_ray.direction.homogeneous())) / slope_per_px.norm();
}

}  // namespace

Triangulator::Triangulator(const CalibratedCamera& camera, const Lens& projector)
    : projector_from_camera_(camera.projector_from_camera),
      camera_focal_px_(camera.lens.fx, camera.lens.fy),
      projector_focal_px_(projector.fx, projector.fy) {}

TriangulatedPoint Triangulator::triangulate(const PixelRay& camera_ray, const PixelRay& projector_ray,
                                            double camera_sigma_px) const {
  const Rows rows = rows_of(camera_ray.direction, projector_ray.direction, projector_from_camera_, camera_focal_px_,
                            projector_focal_px_);
  const Eigen::Matrix3d inverse = inverse_of(normal_matrix(rows));
  Eigen::Vector3d point = inverse * (rows.b_x * rows.lit_x + rows.b_y * rows.lit_y);  // (37)
  const double slope = slope_mm_per_px(rows, inverse, point, camera_ray, camera_focal_px_);
  const auto& [rotation, translation] = projector_from_camera_;
  const bool in_front = rotation.row(2).dot(point) + translation.z() > 0;
  if (!in_front) point.setConstant(std::numeric_limits<double>::quiet_NaN());
  return {point, camera_sigma_px * slope,
          epipolar_residual_px(camera_ray.direction, projector_ray, projector_from_camera_)};
}

}  // namespace slsd
