// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr double kAzimuthRad = 0.3;
constexpr double kElevationRad = 0.22;
constexpr double kTrimmedOfAxis = 0.002;  // at either end of an axis
constexpr double kMargin = 0.05;
constexpr double kThinnest = 0.2;  // of the widest side
constexpr double kSmallestMm = 1.0;

// Nearly all values, so that a few stray points do not shrink the rest to a dot.
void span(std::vector<double> values, double& low, double& high) {
  std::sort(values.begin(), values.end());
  const auto skipped = static_cast<std::size_t>(kTrimmedOfAxis * static_cast<double>(values.size()));
  low = values[skipped];
  high = values[values.size() - 1 - skipped];
  const double margin = kMargin * std::max(high - low, 1e-3);
  low = std::max(low - margin, values.front() - margin);
  high = std::min(high + margin, values.back() + margin);
}

}  // namespace

Box box_of(const Cloud& cloud) {
  Box box;
  if (cloud.points.empty()) return box;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const CloudPoint& point : cloud.points) values.push_back(std::array{point.x, point.y, point.z}[axis]);
    span(std::move(values), box.low[axis], box.high[axis]);
  }
  const double thinnest = std::max(kThinnest * box.size().maxCoeff(), kSmallestMm);
  for (int axis = 0; axis < 3; ++axis) {
    const double missing = std::max(0.0, thinnest - box.size()[axis]);
    box.low[axis] -= 0.5 * missing;
    box.high[axis] += 0.5 * missing;
  }
  return box;
}

View::View(const Box& box, const Frame& frame) {
  const Eigen::Vector3d forward(-std::sin(kAzimuthRad) * std::cos(kElevationRad), std::sin(kElevationRad),
                                std::cos(kAzimuthRad) * std::cos(kElevationRad));
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d(0, -1, 0)).normalized();
  axes_ << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  const Eigen::Vector3d extent = axes_.cwiseAbs() * box.size();
  px_per_mm_ = std::min(frame.width_px / extent.x(), frame.height_px / extent.y());
  const Eigen::Vector3d middle = axes_ * (0.5 * (box.low + box.high)) * px_per_mm_;
  shift_ << frame.left_px + 0.5 * frame.width_px - middle.x(), frame.top_px + 0.5 * frame.height_px - middle.y(), 0;
}

}  // namespace slsd
