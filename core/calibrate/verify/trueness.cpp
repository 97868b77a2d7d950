// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify/trueness.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr std::size_t kCornersMin = 4;
constexpr double kLongShare = 0.5;  // share of the longest: shorter ones show the corners' noise more than the scale

struct MeasuredCorner {
  Eigen::Vector3d measured_mm;
  Eigen::Vector2d true_mm;
};

std::vector<MeasuredCorner> on_plane(const std::vector<BoardPoint>& corners, const Lens& camera,
                                     const PlaneFit& plane) {
  std::vector<MeasuredCorner> out;
  for (const BoardPoint& corner : corners) {
    if (!corner.outlying) out.push_back({plane.meet(camera.undistort(corner.camera_px)), corner.board_mm});
  }
  return out;
}

template <class Visit>
void each_distance(const std::vector<MeasuredCorner>& corners, const Visit& visit) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      visit((corners[i].measured_mm - corners[j].measured_mm).norm(), (corners[i].true_mm - corners[j].true_mm).norm());
    }
  }
}

}  // namespace

std::optional<Trueness> measure_trueness(const std::vector<BoardPoint>& corners, const Lens& camera,
                                         const PlaneFit& plane) {
  const std::vector<MeasuredCorner> points = on_plane(corners, camera, plane);
  if (points.size() < kCornersMin) return std::nullopt;
  Trueness trueness;
  trueness.corners = points.size();
  double longest = 0, product = 0, square = 0;
  each_distance(points, [&](double measured, double is) {
    longest = std::max(longest, is), product += measured * is, square += is * is;
  });
  if (!(square > 0)) return std::nullopt;
  trueness.scale_percent = 100 * (product / square - 1);
  double sum = 0, count = 0;
  each_distance(points, [&](double measured, double is) {
    if (is < kLongShare * longest) return;
    const double percent = 100 * (measured / is - 1);
    sum += percent * percent, ++count;
    if (std::abs(percent) > std::abs(trueness.worst_percent)) trueness.worst_percent = percent;
  });
  trueness.long_rms_percent = std::sqrt(sum / count);
  return trueness;
}

}  // namespace slsd
