// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/triangulate.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>

#include "core/geometry/pixel_ray.hpp"

namespace slsd {
namespace {

using ProjectionMatrix = Eigen::Matrix<double, 3, 4>;

struct Equations {
  Eigen::Matrix<double, 4, 3> a;
  Eigen::Vector4d b;
};

// M and N of equations (32) and (33); the world is the camera's frame.
ProjectionMatrix projection(const Lens& lens, const RigidTransform& motion) {
  Eigen::Matrix3d pinhole;
  pinhole << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  ProjectionMatrix matrix;
  matrix << motion.rotation, motion.translation;
  return pinhole * matrix;
}

// The pixel as a lens without distortion would see it.
Eigen::Vector2d straight_px(const Lens& lens, const Eigen::Vector2d& direction) {
  return {lens.fx * direction.x() + lens.cx, lens.fy * direction.y() + lens.cy};
}

// Equations (34) to (36): two rows for each pixel.
void add_rows(Equations& equations, int row, const ProjectionMatrix& matrix, const Eigen::Vector2d& pixel) {
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::RowVector4d line = pixel[axis] * matrix.row(2) - matrix.row(axis);
    equations.a.row(row + axis) = line.head<3>();
    equations.b[row + axis] = -line[3];
  }
}

// Derivative of the least-squares point with respect to the camera's pixel, by differentiating its normal equations.
Eigen::Matrix<double, 3, 2> point_per_px(const Equations& equations, const Eigen::Vector3d& point, const Lens& lens,
                                         const Eigen::Matrix2d& turn) {
  const Eigen::Matrix3d inverse = (equations.a.transpose() * equations.a).inverse();
  const Eigen::Vector4d residual = equations.a * point - equations.b;
  Eigen::Matrix<double, 3, 2> by_direction;
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::Matrix<double, 4, 3> da = Eigen::Matrix<double, 4, 3>::Zero();
    da(axis, 2) = axis == 0 ? lens.fx : lens.fy;
    by_direction.col(axis) = -inverse * (da.transpose() * residual + equations.a.transpose() * da * point);
  }
  return by_direction * turn;
}

}  // namespace

TriangulatedPoint triangulate(const Match& match, const CalibratedCamera& camera, const Lens& projector,
                              double camera_sigma_px) {
  const PixelRay camera_ray = pixel_ray(camera.lens, match.camera_px);
  const PixelRay projector_ray = pixel_ray(projector, match.projector_px);
  Equations equations;
  add_rows(equations, 0, projection(camera.lens, {}), straight_px(camera.lens, camera_ray.direction));
  add_rows(equations, 2, projection(projector, camera.projector_from_camera),
           straight_px(projector, projector_ray.direction));
  Eigen::Vector3d point = equations.a.colPivHouseholderQr().solve(equations.b);  // (37)
  const Eigen::RowVector3d along_ray = camera_ray.direction.homogeneous().normalized().transpose();
  const double sigma_mm =
      camera_sigma_px * (along_ray * point_per_px(equations, point, camera.lens, camera_ray.turn)).norm();
  if (!((camera.projector_from_camera * point).z() > 0)) point.setConstant(std::numeric_limits<double>::quiet_NaN());
  return {point, sigma_mm};
}

double signed_epipolar_residual_px(const Match& match, const CalibratedCamera& camera, const Lens& projector) {
  const PixelRay projector_ray = pixel_ray(projector, match.projector_px);
  const auto& [rotation, translation] = camera.projector_from_camera;
  const Eigen::Vector3d line = translation.cross(rotation * camera.lens.undistort(match.camera_px).homogeneous());
  const Eigen::Vector2d slope_per_px = projector_ray.turn.transpose() * line.head<2>();
  return line.dot(projector_ray.direction.homogeneous()) / slope_per_px.norm();
}

double epipolar_residual_px(const Match& match, const CalibratedCamera& camera, const Lens& projector) {
  return std::abs(signed_epipolar_residual_px(match, camera, projector));
}

}  // namespace slsd
