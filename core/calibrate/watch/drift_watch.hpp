// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/cloud/cloud.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/epipolar_limit.hpp"

namespace slsd {

/// Evidence of the scans about one camera's calibration.
struct DriftState {
  std::uint64_t scans = 0;  ///< scans with enough points to say something
  double epipolar_px = 0;   ///< distance of recent scans' points from their epipolar lines, in the
                            ///< projector: the median of the quarter of the picture that is farthest off
  double limit_px = 0;      ///< up to here it is as it was calibrated
  std::optional<std::uint64_t> off_since_scan;  ///< the number of the first scan of a rig that was knocked out
};

/// Watches how far the points of ordinary scans lie off their epipolar lines. As a rig is knocked out of its
/// calibration they all move to one side, or, where a camera was rolled, to one side in each part of the picture:
///
///     shifted           rolled            noise alone
///     + + | + +         + + | - -         + - | - +
///     ----+----         ----+----         ----+----      the median of each quarter, averaged over about 5 scans,
///     + + | + +         + + | - -         - + | + -      tells them apart
///
/// A knock by more than the decoder's tolerance leaves no points: their symbols, read without it, do as well.
/// @thread thread-bound
class DriftWatch {
 public:
  /// @param camera       of this calibration
  /// @param expected_px  what the calibration says of itself; nothing: learnt from the first 20 scans
  DriftWatch(const CalibratedCamera& camera, const Lens& projector, std::optional<double> expected_px);

  /// Change of a scan's state.
  enum class Change { kNone, kOff, kFineAgain };

  /// Takes a scan's points; a part of them, evenly, where they are many. Allocates nothing.
  /// @param points  of any camera: those of the others are passed over
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
    double running_px = 0;  // the average of the medians
    std::uint64_t scans = 0;
    std::uint64_t last = 0;  // DriftState::scans as it last had points
  };

  void sample(std::span<const CloudPoint> points, std::uint8_t camera);
  [[nodiscard]] std::optional<double> average_quarters();
  void learn();
  [[nodiscard]] Change judge(double own_px, std::uint64_t scan);

  CalibratedCamera camera_;
  Lens projector_;
  bool learns_;
  std::array<Quarter, kQuarters> quarters_{};
  std::optional<std::uint64_t>
      beyond_since_;  // the first of the scans in a row that are beyond the limit by themselves
  DriftState state_;
};

}  // namespace slsd
