// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/rig_outlook.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr int kAcross = 9, kDown = 7, kDepths = 9;
constexpr double kErrorPx = 0.1;

double square(double value) {
  return value * value;
}

/// Directions of a grid of an image's pixels, with z = 1 rather than unit length.
std::vector<Eigen::Vector3d> directions_over(const Lens& lens) {
  std::vector<Eigen::Vector3d> directions;
  for (int row = 0; row < kDown; ++row) {
    for (int column = 0; column < kAcross; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) * lens.width_px / kAcross - 0.5,
                                  (row + 0.5) * lens.height_px / kDown - 0.5);
      directions.emplace_back(lens.undistort(pixel).homogeneous());
    }
  }
  return directions;
}

Eigen::Vector2d pinhole_pixel(const Lens& lens, const Eigen::Vector3d& point) {
  return {lens.fx * point.x() / point.z() + lens.cx, lens.fy * point.y() / point.z() + lens.cy};
}

bool is_inside(const Lens& lens, const Eigen::Vector2d& pixel) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= lens.width_px - 0.5 &&
         pixel.y() <= lens.height_px - 0.5;
}

// Without distortion, which far outside the image folds back into it.
bool sees(const Lens& lens, const Eigen::Vector3d& point) {
  return point.z() > 0 && is_inside(lens, pinhole_pixel(lens, point));
}

/// The point on a projector's ray at a depth of the camera, in the camera's frame; empty if the ray has none.
std::optional<Eigen::Vector3d> point_at_depth(const RigidTransform& camera_from_projector,
                                              const Eigen::Vector3d& direction, double depth_mm) {
  const Eigen::Vector3d start = camera_from_projector.translation, slope = camera_from_projector.rotation * direction;
  const double along = (depth_mm - start.z()) / slope.z();
  if (!(along > 0) || !std::isfinite(along)) return std::nullopt;
  return start + along * slope;
}

double lit_share_at(const CameraRig& rig, const std::vector<Eigen::Vector3d>& camera,
                    const std::vector<Eigen::Vector3d>& projector, double depth_mm) {
  const RigidTransform& there = rig.camera.projector_from_camera;
  const RigidTransform back = there.inverse();
  const auto lit = std::ranges::count_if(camera, [&](const Eigen::Vector3d& direction) {
    return sees(rig.projector, there * Eigen::Vector3d(depth_mm * direction));
  });
  const auto seen = std::ranges::count_if(projector, [&](const Eigen::Vector3d& direction) {
    const auto point = point_at_depth(back, direction, depth_mm);
    return point && sees(rig.camera.lens, *point);
  });
  return static_cast<double>(std::max(lit, seen)) / (kAcross * kDown);
}

double depth_of(const DepthRange& range, int step) {
  return range.min_mm * std::pow(range.max_mm / range.min_mm, static_cast<double>(step) / (kDepths - 1));
}

double log_normal(double value, double middle, double deviations) {
  return value > 0 ? -0.5 * square(std::log(value / middle) / deviations) : -1e3;
}

// Focal lengths in practice are half the image's width to ten times the width.
double log_focal_length(double share_of_width) {
  return log_normal(share_of_width, 1.4, 0.8);
}

double log_decentring(const Lens& lens) {
  constexpr double kDeviation = 0.004, kPoorlyMeasured = 1e-3;
  const double off = square(lens.distortion[2] / kDeviation) + square(lens.distortion[3] / kDeviation);
  return std::log(std::exp(-0.5 * off) + kPoorlyMeasured);
}

}  // namespace

double DepthRange::middle_mm() const {
  return std::sqrt(min_mm * max_mm);
}

double RigOutlook::log_likelihood() const {
  constexpr double kOftenLit = 0.3, kNever = 1e-4;
  constexpr double kUsualBaseline = 0.2, kBaselineDeviations = 0.75;
  return std::min(0.0, std::log((lit_share + kNever) / kOftenLit)) +
         log_normal(baseline_share, kUsualBaseline, kBaselineDeviations);
}

RigOutlook look_at_rig(const CameraRig& rig, const DepthRange& range) {
  const auto camera = directions_over(rig.camera.lens), projector = directions_over(rig.projector);
  const RigidTransform& there = rig.camera.projector_from_camera;
  const Eigen::Vector3d axis = camera[camera.size() / 2];
  const double middle_mm = range.middle_mm();
  RigOutlook outlook{};
  for (int step = 0; step < kDepths; ++step) {
    outlook.lit_share = std::max(outlook.lit_share, lit_share_at(rig, camera, projector, depth_of(range, step)));
  }
  outlook.baseline_mm = there.inverse().translation.cross(axis.normalized()).norm();
  outlook.baseline_share = outlook.baseline_mm / middle_mm;
  const auto pixel_at = [&](double depth_mm) {
    return pinhole_pixel(rig.projector, there * Eigen::Vector3d(depth_mm * axis));
  };
  outlook.parallax_px = (pixel_at(range.max_mm) - pixel_at(range.min_mm)).norm();
  constexpr double kStep = 1e-3;
  const double px_per_mm = (pixel_at(middle_mm * (1 + kStep)) - pixel_at(middle_mm)).norm() / (middle_mm * kStep);
  outlook.sigma_mm = px_per_mm > 0 ? kErrorPx / px_per_mm : HUGE_VAL;
  return outlook;
}

LensLikelihood camera_likelihood(const Lens& lens) {
  constexpr double kAcrossDeviation = 0.05, kDownDeviation = 0.06;
  constexpr double kCropped = 4e-4, kNever = 1e-6;  // a crop of the sensor may lie anywhere
  const double x = lens.cx / lens.width_px, y = lens.cy / lens.height_px;
  const double off = square((x - 0.5) / kAcrossDeviation) + square((y - 0.5) / kDownDeviation);
  const bool inside = is_inside(lens, {lens.cx, lens.cy});
  return {std::log(std::exp(-0.5 * off) + (inside ? kCropped : 0) + kNever), log_focal_length(lens.fx / lens.width_px),
          log_decentring(lens)};
}

LensLikelihood projector_likelihood(const Lens& lens) {
  constexpr double kAcrossDeviation = 0.05, kShiftedAcross = 1e-3, kNever = 1e-6;
  constexpr double kShiftedMost = 1.2;  // largest shift beyond the image's edge, of its height
  const double x = lens.cx / lens.width_px, y = lens.cy / lens.height_px;
  const bool inside = x >= 0 && x <= 1, shifted = y >= -kShiftedMost && y <= 1 + kShiftedMost;
  const double across = std::exp(-0.5 * square((x - 0.5) / kAcrossDeviation)) + (inside ? kShiftedAcross : 0);
  return {std::log((shifted ? across : 0) + kNever), log_focal_length(lens.fx / lens.width_px), log_decentring(lens)};
}

}  // namespace slsd
