// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/mounted.hpp"
#include "core/hand_eye/locate_board.hpp"

namespace slsd {

/// One view of a session.
struct HandEyeView {
  std::string name;
  LocatedBoard board;
  RigidTransform base_from_flange;
};

/// A session of views, in the order in which they were taken.
struct HandEyeSession {
  Mounted mounted = Mounted::kArm;
  std::vector<HandEyeView> views;
  SharedErrors shared;
  double corner_px = 0.05;  ///< one standard deviation of a corner's coordinate
};

/// Events of a session that can be fitted. By default there are none.
struct HandEyeModel {
  std::vector<std::size_t> left_out;         ///< views that are unrelated to the others
  std::optional<std::size_t> scanner_moved;  ///< the first view after the scanner moved on what carries it
  std::optional<std::size_t> board_moved;    ///< the same for the board
  bool late = false;                         ///< the robot's poses were read somewhere on the way from view to view
};

/// The mounting of scanner and board. `mount` carries the scanner: the flange (kArm) or the base (kCell); `stand`
/// carries the board: the base (kArm) or the flange (kCell).
struct HandEyePlaces {
  RigidTransform mount_from_rig;
  RigidTransform stand_from_board;
};

/// mount_from_stand at one pose of the robot.
[[nodiscard]] inline RigidTransform mount_from_stand(Mounted mounted, const RigidTransform& base_from_flange) {
  return mounted == Mounted::kArm ? base_from_flange.inverse() : base_from_flange;
}

/// Prior of a move of the scanner or the board: one standard deviation of each coordinate.
inline constexpr double kMovedMm = 100, kMovedRad = 0.2;

/// Noise of the robot's poses: one standard deviation of each coordinate.
struct RobotNoise {
  double place_mm = 0.07;
  double turn_rad = 5e-4;
};

}  // namespace slsd
