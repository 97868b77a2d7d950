// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/watch/drift_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/robust.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr std::size_t kPointsMin = 10;     // in a quarter of the image, for a meaningful median
constexpr std::size_t kLookedAtMax = 256;  // largest number of points of a scan that are used
constexpr std::uint64_t kLearntScans = 20;
constexpr std::uint64_t kAveragedScans = 5;  // medians of many points: a knock is detected within ten scans
constexpr std::uint64_t kScansMin = 5;       // before any report
constexpr std::uint64_t kSpeaksFor = 20;     // number of scans for which a quarter's average stays valid without new
                                             // points
// Misread symbols lie anywhere, so their distances are no common shift. The spread is half of the points' distance.
constexpr double kSpreadMaxPx = 2, kSpreadMaxShare = 0.5;
constexpr double kFineAgainShare = 0.8;    // share of the limit: hysteresis against repeated changes
constexpr double kLearntLimitMaxPx = 1.0;  // a rig may already be off when the service starts

}  // namespace

DriftWatch::DriftWatch(const CalibratedCamera& camera, const Lens& projector, std::optional<double> expected_px)
    : camera_(camera), projector_(projector), learns_(!expected_px) {
  state_.limit_px = watch_limit_px(expected_px);
}

void DriftWatch::sample(std::span<const CloudPoint> points, std::uint8_t camera) {
  for (Quarter& quarter : quarters_) quarter.count = 0;
  const auto own = static_cast<std::size_t>(std::ranges::count(points, camera, &CloudPoint::camera));
  const std::size_t step = std::max<std::size_t>(1, (own + kLookedAtMax - 1) / kLookedAtMax);
  std::size_t seen = 0;
  for (const CloudPoint& point : points) {
    if (point.camera != camera || seen++ % step != 0) continue;
    const std::size_t right = point.camera_u > static_cast<float>(camera_.lens.width_px) / 2 ? 1 : 0,
                      lower = point.camera_v > static_cast<float>(camera_.lens.height_px) / 2 ? 1 : 0;
    Quarter& quarter = quarters_[2 * lower + right];
    if (quarter.count == kSampled) continue;
    const Match match{{point.camera_u, point.camera_v}, {point.projector_u, point.projector_v}};
    const double residual = signed_epipolar_residual_px(match, camera_, projector_);
    if (std::isfinite(residual)) quarter.residuals_px[quarter.count++] = static_cast<float>(residual);
  }
}

// A plain average of the first scans, then a running one with a memory of about as many.
std::optional<double> DriftWatch::average_quarters() {
  std::optional<double> own_px;
  state_.epipolar_px = 0;
  for (Quarter& quarter : quarters_) {
    if (quarter.count >= kPointsMin) {
      const std::span<float> residuals = std::span(quarter.residuals_px).first(quarter.count);
      const double off_px = median_in_place(residuals);
      for (float& residual : residuals) residual = std::abs(residual - static_cast<float>(off_px));
      if (median_in_place(residuals) > std::max(kSpreadMaxPx, kSpreadMaxShare * std::abs(off_px))) continue;
      quarter.last = state_.scans;
      quarter.scans = std::min(quarter.scans + 1, kAveragedScans);
      quarter.running_px += (off_px - quarter.running_px) / static_cast<double>(quarter.scans);
      own_px = std::max(own_px.value_or(0), std::abs(off_px));
    }
    const bool speaks = quarter.scans >= kScansMin && state_.scans - quarter.last < kSpeaksFor;
    if (speaks) state_.epipolar_px = std::max(state_.epipolar_px, std::abs(quarter.running_px));
  }
  return own_px;
}

void DriftWatch::learn() {
  learns_ = false;
  state_.limit_px = std::min(kLearntLimitMaxPx, watch_limit_px(state_.epipolar_px));
}

DriftWatch::Change DriftWatch::judge(double own_px, std::uint64_t scan) {
  if (own_px <= state_.limit_px) beyond_since_.reset();
  if (own_px > state_.limit_px && !beyond_since_) beyond_since_ = scan;
  if (!state_.off_since_scan && state_.epipolar_px > state_.limit_px) {
    state_.off_since_scan = beyond_since_.value_or(scan);
    return Change::kOff;
  }
  if (state_.off_since_scan && state_.epipolar_px <= kFineAgainShare * state_.limit_px) {
    state_.off_since_scan.reset();
    return Change::kFineAgain;
  }
  return Change::kNone;
}

DriftWatch::Change DriftWatch::note(std::span<const CloudPoint> points, std::uint8_t camera, std::uint64_t scan) {
  sample(points, camera);
  const auto own_px = average_quarters();
  if (!own_px) return Change::kNone;
  ++state_.scans;
  if (learns_ && state_.scans == kLearntScans) learn();
  return learns_ ? Change::kNone : judge(*own_px, scan);
}

}  // namespace slsd
