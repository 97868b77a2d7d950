// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/geometry/mounted.hpp"
#include "core/result.hpp"

namespace slsd {

/// Place of a scanner in a robot cell, as hand_eye.yml keeps it.
struct HandEyeCalibration {
  Mounted mounted = Mounted::kArm;
  RigidTransform mount_from_rig;  ///< flange_from_rig (kArm) or base_from_rig (kCell)
  /// Covariance of its turn (rad) and place (mm), along the axes of flange or base.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double distance_mm = 0, error_mm = 0;           ///< 95 % of points at this distance are off by less
  std::string verdict;                            ///< "good" or "usable"
  double robot_place_mm = 0, robot_turn_rad = 0;  ///< noise of the robot's poses, one standard deviation
  int poses = 0;
  std::string board, date;
  std::string calibration_date;  ///< date of the scanner's calibration; empty: it has none
};

/// Reads a hand-eye file's text (OpenCV FileStorage YAML, keys in docs/formats.md): mounting and place.
/// @errors kMalformed, kInvalidArgument: the message names the key
[[nodiscard]] Result<HandEyeCalibration> read_hand_eye(std::string_view text, std::string_view name);
/// Writes it; what read_hand_eye() does not read only if it is known.
[[nodiscard]] std::string write_hand_eye(const HandEyeCalibration& hand_eye);

}  // namespace slsd
