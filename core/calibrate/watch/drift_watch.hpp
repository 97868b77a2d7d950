// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/cloud/cloud.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/epipolar/epipolar_limit.hpp"

namespace slsd {

/// The remedy for a knocked rig, in every message about one.
inline constexpr const char* kKnockRemedy =
    "fasten projector and camera, stop the service and run slsd --correct with a board in view; if it refuses, "
    "calibrate again";

/// Evidence from scans about one camera's calibration.
struct DriftState {
  std::uint64_t scans = 0;  ///< number of scans with enough points
  double epipolar_px = 0;   ///< distance of recent scans' points from their epipolar lines, in the projector: the
                            ///< median of the quarter of the image that is farthest off
  double limit_px = 0;      ///< up to this limit, the calibration holds
  std::optional<std::uint64_t> off_since_scan;  ///< the number of the first scan after the rig was knocked out of its
                                                ///< calibration
};

/// Watches how far the points of ordinary scans lie off their epipolar lines. If a knock puts the rig out of its
/// calibration, all points move to one side. If a camera rolled, they move to one side in each part of the image:
///
///     shifted           rolled            noise alone
///     + + | + +         + + | - -         + - | - +
///     ----+----         ----+----         ----+----      the median of each quarter, averaged over about 5 scans,
///     + + | + +         + + | - -         - + | + -      tells them apart
///
/// A knock beyond the decoder's tolerance leaves no points. Symbols read without the epipolar line then take their
/// place.
/// @thread thread-bound
class DriftWatch {
 public:
  /// @param camera       camera of this calibration
  /// @param expected_px  the calibration's own figure; empty: learnt from the first 20 scans
  DriftWatch(const CalibratedCamera& camera, const Lens& projector, std::optional<double> expected_px);

  /// Change of the state after a scan.
  enum class Change { kNone, kOff, kFineAgain };

  /// Takes a scan's points; of many, an even sample. Allocates nothing.
  /// @param points  points of any camera; those of others are skipped
  /// @param camera  this one's index in the calibration
  /// @param scan    its number
  [[nodiscard]] Change note(std::span<const CloudPoint> points, std::uint8_t camera, std::uint64_t scan);

  [[nodiscard]] const DriftState& state() const { return state_; }

 private:
  static constexpr std::size_t kQuarters = 4;
  static constexpr std::size_t kSampled = 64;  // points of a quarter and scan

  struct Quarter {
    std::array<float, kSampled> residuals_px{};
    std::size_t count = 0;
    double running_px = 0;  // the running average of the medians
    std::uint64_t scans = 0;
    std::uint64_t last = 0;  // DriftState::scans when it last had points
  };

  void sample(std::span<const CloudPoint> points, std::uint8_t camera);
  [[nodiscard]] std::optional<double> average_quarters();
  void learn();
  [[nodiscard]] Change judge(double own_px, std::uint64_t scan);

  CalibratedCamera camera_;
  Lens projector_;
  bool learns_;
  std::array<Quarter, kQuarters> quarters_{};
  std::optional<std::uint64_t> beyond_since_;  // the first of consecutive scans that are each beyond the limit
  DriftState state_;
};

}  // namespace slsd
