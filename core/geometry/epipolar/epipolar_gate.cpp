// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/epipolar/epipolar_gate.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "core/clones.hpp"

namespace slsd {
namespace {

// A point nearer than this to the projector's plane counts as behind it.
constexpr double kMinProjectorDepthMm = 1.0;

/// Data of many segments, one column for each quantity.
struct Segments {
  PixelRays::Column line_x, line_y, offset, axis_x, axis_y, least, most;
};

inline __attribute__((always_inline)) void find_segments(const EpipolarRig& rig, const PixelRays& rays,
                                                         std::size_t count, Segments& to) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const auto& [rotation, start] = rig.projector_from_camera;
  const Eigen::Matrix3d e = rig.line_from_camera, r = rotation;
  const double start_x = start.x(), start_y = start.y(), start_z = start.z();
  const double per_fx = rig.per_focal_px.x(), per_fy = rig.per_focal_px.y(), fx = rig.focal_px.x(),
               fy = rig.focal_px.y();
  const double depth_min = rig.depth_min_mm, depth_max = rig.depth_max_mm;
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double x = rays.x[i], y = rays.y[i];
    const double line_x = e(0, 0) * x + e(0, 1) * y + e(0, 2), line_y = e(1, 0) * x + e(1, 1) * y + e(1, 2),
                 line_z = e(2, 0) * x + e(2, 1) * y + e(2, 2);
    const double normal_x = line_x * per_fx, normal_y = line_y * per_fy;
    const double length = std::sqrt(normal_x * normal_x + normal_y * normal_y);
    const double per_length = 1 / length;
    const double axis_x = -normal_y * per_length * fx, axis_y = normal_x * per_length * fy;
    // The ray in the projector's frame: start + depth * slope.
    const double slope_x = r(0, 0) * x + r(0, 1) * y + r(0, 2), slope_y = r(1, 0) * x + r(1, 1) * y + r(1, 2),
                 slope_z = r(2, 0) * x + r(2, 1) * y + r(2, 2);
    const double crossing = (kMinProjectorDepthMm - start_z) / slope_z;
    const bool rises = (slope_z > 0) & (crossing > depth_min), falls = (slope_z < 0) & (crossing < depth_max);
    const double nearest = rises ? crossing : depth_min, farthest = falls ? crossing : depth_max;
    const double near_z = start_z + nearest * slope_z, far_z = start_z + farthest * slope_z;
    // Position along the line at a depth: the point's component along the axis, over its depth in the projector's
    // frame.
    const double along_start = axis_x * start_x + axis_y * start_y, along_slope = axis_x * slope_x + axis_y * slope_y;
    const double near_px = (along_start + nearest * along_slope) / near_z,
                 far_px = (along_start + farthest * along_slope) / far_z;
    const bool is_line = length > 0, in_front = (nearest <= farthest) & (near_z > 0) & is_line;
    to.line_x[i] = is_line ? line_x * per_length : 0, to.line_y[i] = is_line ? line_y * per_length : 0;
    to.offset[i] = is_line ? line_z * per_length : kFar;
    to.axis_x[i] = is_line ? axis_x : 0, to.axis_y[i] = is_line ? axis_y : 0;
    to.least[i] = in_front ? (near_px < far_px ? near_px : far_px) : 1;
    to.most[i] = in_front ? (near_px < far_px ? far_px : near_px) : -1;
  }
}

inline __attribute__((always_inline)) void compare_rays(const EpipolarRig& rig, const RayPairs& rays, std::size_t count,
                                                        float* residuals_px, float* disparities) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const auto& [rotation, start] = rig.projector_from_camera;
  const Eigen::Matrix3d e = rig.line_from_camera, r = rotation;
  const double baseline_mm = start.norm(), start_x = start.x(), start_y = start.y(), start_z = start.z();
  const double per_fx = rig.per_focal_px.x(), per_fy = rig.per_focal_px.y();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double x = rays.camera_x[i], y = rays.camera_y[i], u = rays.projector_x[i], v = rays.projector_y[i];
    const double line_x = e(0, 0) * x + e(0, 1) * y + e(0, 2), line_y = e(1, 0) * x + e(1, 1) * y + e(1, 2),
                 line_z = e(2, 0) * x + e(2, 1) * y + e(2, 2);
    const double normal_x = line_x * per_fx, normal_y = line_y * per_fy;
    const double length = std::sqrt(normal_x * normal_x + normal_y * normal_y);
    residuals_px[i] = static_cast<float>(length > 0 ? (line_x * u + line_y * v + line_z) / length : kFar);
    // The ray in the projector's frame, and the components along the line.
    const double slope_x = r(0, 0) * x + r(0, 1) * y + r(0, 2), slope_y = r(1, 0) * x + r(1, 1) * y + r(1, 2),
                 slope_z = r(2, 0) * x + r(2, 1) * y + r(2, 2);
    const double there = line_x * v - line_y * u;
    const double over = line_x * start_y - line_y * start_x - there * start_z;
    const double along = there * slope_z - (line_x * slope_y - line_y * slope_x);
    disparities[i] = static_cast<float>(over != 0 ? baseline_mm * along / over : 0);
  }
}

}  // namespace

EpipolarGate::EpipolarGate(const CalibratedCamera& camera, const Lens& projector, double depth_min_mm,
                           double depth_max_mm)
    : rig_{.projector_from_camera = camera.projector_from_camera,
           .line_from_camera =
               -camera.projector_from_camera.rotation.colwise().cross(camera.projector_from_camera.translation),
           .focal_px = {projector.fx, projector.fy},
           .per_focal_px = {1 / projector.fx, 1 / projector.fy},
           .depth_min_mm = depth_min_mm,
           .depth_max_mm = depth_max_mm} {}

void EpipolarGate::prepare(const PixelRays& rays, std::span<EpipolarSegment> segments) const {
  Segments found;
  Cloned<find_segments>::call(rig_, rays, segments.size(), found);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    EpipolarSegment& segment = segments[i];
    segment.line_ = {found.line_x[i], found.line_y[i]};
    segment.axis_ = {found.axis_x[i], found.axis_y[i]};
    segment.line_offset_px_ = found.offset[i];
    segment.along_min_px_ = found.least[i], segment.along_max_px_ = found.most[i];
  }
}

EpipolarSegment EpipolarGate::prepare(const Eigen::Vector2d& camera_direction) const {
  PixelRays one;
  one.x[0] = camera_direction.x(), one.y[0] = camera_direction.y();
  EpipolarSegment segment;
  prepare(one, std::span(&segment, 1));
  return segment;
}

void EpipolarGate::compare(const RayPairs& rays, std::span<float> residuals_px, std::span<float> disparities) const {
  Cloned<compare_rays>::call(rig_, rays, residuals_px.size(), residuals_px.data(), disparities.data());
}

}  // namespace slsd
