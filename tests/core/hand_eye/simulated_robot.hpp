// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "core/hand_eye/hand_eye_model.hpp"

namespace slsd {

/// A robot cell with a scanner, and what is wrong with it.
struct SimulatedRobot {
  Mounted mounted = Mounted::kArm;
  int poses = 12;
  double distance_min_mm = 600, distance_max_mm = 1500;
  RobotNoise noise{0.05, 0.02 * 0.017453292519943295};
  double corner_px = 0.05;
  double print_scale = 2e-4;  ///< one standard deviation of the print's scale
  double focal_px = 0.4;      ///< of fx and fy alike, 2000 px
  double turn_max_rad = 0.6;  ///< of the board against the line of sight
  double roll_max_rad = 0.8;  ///< of the board about the line of sight
  bool one_axis = false;      ///< the robot turns about the vertical alone
};

/// A session as it was, and as it was recorded.
struct SimulatedSession {
  Calibration truth, calibration;
  Board board;
  HandEyePlaces places;
  std::vector<RigidTransform> base_from_flange;        ///< as they were
  std::vector<std::vector<CameraSighting>> sightings;  ///< one for each pose
  HandEyeSession session;                              ///< with the poses as the robot told them
};

/// Draws a cell, a scanner, a board and poses anew.
[[nodiscard]] SimulatedSession simulate(const SimulatedRobot& robot, std::uint32_t seed);

/// Pictures of the board where it stands in the rig at each pose, with noise.
[[nodiscard]] std::vector<CameraSighting> look_at_board(const Calibration& truth, const Board& board,
                                                        const RigidTransform& rig_from_board, double corner_px,
                                                        std::mt19937& random);

/// A rotation by a vector in radians.
[[nodiscard]] Eigen::Matrix3d turned_by(const Eigen::Vector3d& vector_rad);

/// Locates the boards of the pictures, as a session does.
void locate_all(SimulatedSession& simulated);

}  // namespace slsd
