// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>

#include "core/board/board.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Half the paper's rig: a camera of 800x600 and a projector of 640x400, at the same distances.
[[nodiscard]] Calibration small_rig();

/// Whose captures the tests write.
constexpr char kSimulatedBoard[] = "charuco:7x5:60:45:DICT_5X5_100";

/// A pose of the board: its plane in the camera's frame.
[[nodiscard]] RigidTransform simulated_pose(int index);

/// Writes DIR/pose_NN/white.png and pattern.png as the rig's camera sees a printed board.
void write_simulated_pose(const std::filesystem::path& folder, const Calibration& rig, const Board& board,
                          const Pattern& pattern, const RigidTransform& camera_from_board);

}  // namespace slsd
