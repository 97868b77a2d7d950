// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/epipolar_gate.hpp"

#include <algorithm>

#include <Eigen/Geometry>

namespace slsd {
namespace {

// A point nearer than this to the projector's plane is taken for behind it.
constexpr double kMinProjectorDepthMm = 1.0;

}  // namespace

EpipolarGate::EpipolarGate(const CalibratedCamera& camera, const Lens& projector, double depth_min_mm,
                           double depth_max_mm)
    : projector_from_camera_(camera.projector_from_camera),
      focal_px_(projector.fx, projector.fy),
      per_focal_px_(1 / focal_px_),
      depth_min_mm_(depth_min_mm),
      depth_max_mm_(depth_max_mm) {}

EpipolarSegment EpipolarGate::prepare(const Eigen::Vector2d& camera_direction) const {
  // The ray in the projector's frame: start + depth * slope.
  const Eigen::Vector3d slope = projector_from_camera_.rotation * camera_direction.homogeneous();
  const Eigen::Vector3d& start = projector_from_camera_.translation;
  const Eigen::Vector3d line = start.cross(slope);
  const Eigen::Array2d normal = line.head<2>().array() * per_focal_px_;
  const double length = normal.matrix().norm();
  EpipolarSegment segment;
  if (!(length > 0)) return segment;

  const double per_length = 1 / length;
  segment.line_ = line.head<2>() * per_length;
  segment.line_offset_px_ = line.z() * per_length;
  segment.axis_ = (Eigen::Array2d(-normal.y(), normal.x()) * per_length * focal_px_).matrix();

  double nearest = depth_min_mm_, farthest = depth_max_mm_;
  const auto in_front = [&](double depth_mm) { return start.z() + depth_mm * slope.z() >= kMinProjectorDepthMm; };
  if (!in_front(nearest) || !in_front(farthest)) {
    const double crossing = (kMinProjectorDepthMm - start.z()) / slope.z();
    if (slope.z() > 0) nearest = std::max(nearest, crossing);
    if (slope.z() < 0) farthest = std::min(farthest, crossing);
    if (!(nearest <= farthest) || !(start.z() + nearest * slope.z() > 0)) return segment;
  }
  // Along the line at a depth: the axis' part of the point over its depth in the projector's frame.
  const double along_start = segment.axis_.dot(start.head<2>()), along_slope = segment.axis_.dot(slope.head<2>());
  const double near_px = (along_start + nearest * along_slope) / (start.z() + nearest * slope.z()),
               far_px = (along_start + farthest * along_slope) / (start.z() + farthest * slope.z());
  segment.along_min_px_ = std::min(near_px, far_px);
  segment.along_max_px_ = std::max(near_px, far_px);
  return segment;
}

double EpipolarGate::residual_px(const Eigen::Vector2d& camera_direction,
                                 const Eigen::Vector2d& projector_direction) const {
  const Eigen::Vector3d line =
      projector_from_camera_.translation.cross(projector_from_camera_.rotation * camera_direction.homogeneous());
  const double length = (line.head<2>().array() * per_focal_px_).matrix().norm();
  if (!(length > 0)) return std::numeric_limits<double>::infinity();
  return (line.head<2>().dot(projector_direction) + line.z()) / length;
}

double EpipolarGate::disparity(const Eigen::Vector2d& camera_direction,
                               const Eigen::Vector2d& projector_direction) const {
  const Eigen::Vector3d slope = projector_from_camera_.rotation * camera_direction.homogeneous();
  const Eigen::Vector3d& start = projector_from_camera_.translation;
  const Eigen::Vector3d line = start.cross(slope);
  const Eigen::Vector2d along(-line.y(), line.x());
  const double there = along.dot(projector_direction), over = along.dot(start.head<2>()) - there * start.z();
  if (over == 0) return 0;
  return start.norm() * (there * slope.z() - along.dot(slope.head<2>())) / over;
}

}  // namespace slsd
