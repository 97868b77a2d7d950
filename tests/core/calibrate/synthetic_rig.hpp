// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// A rig of the size of the paper's, with distortion on every device.
/// @param cameras  1 or more; each further one 150 mm to the left of the one before
[[nodiscard]] RigModel true_rig(std::size_t cameras = 1);

/// Poses of a board of 500 x 350 mm about 2 m away, tilted by up to 35 degrees, all over the images.
[[nodiscard]] std::vector<MotionVector> true_poses(int count, std::uint32_t seed = 1);

struct SightOptions {
  double corner_sigma_px = 0.03;
  double symbol_sigma_px = 0.08;
  std::uint32_t seed = 1;
  /// How far a pose's board is off its plane at a place, mm along its normal.
  std::function<double(int pose, const Eigen::Vector2d& board_mm)> relief = {};
  /// Where the board is when the pattern is projected, if not where it was: rig from board.
  std::function<MotionVector(int pose, const MotionVector& before)> moved = {};
  double stretch = 0;          ///< of the print, along y
  double symbol_shift_px = 0;  ///< of all symbols of a view alike, along either axis: one standard deviation
};

/// What the rig sees of the poses: exact but for the noise, and for what the options spoil.
[[nodiscard]] Observations see(const RigModel& rig, const std::vector<MotionVector>& poses,
                               const SightOptions& options = {});

}  // namespace slsd
