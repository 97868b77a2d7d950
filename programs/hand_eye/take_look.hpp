// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/geometry/robot_pose.hpp"
#include "programs/calibrate/session/pose_source.hpp"

namespace slsd {

/// A look that was added to a folder.
struct TakenLook {
  std::string name;                         ///< of the new capture
  std::optional<std::string> lines_before;  ///< of poses.csv; empty: there was no such file
};

/// Takes a picture of the board under white light with each camera, and adds it to a folder, with a line for the
/// robot's pose in poses.csv. After an error the folder's looks are as they were.
/// @param numbers  of the robot's pose
/// @errors those of read_robot_pose(), of the source and of the files
[[nodiscard]] Result<TakenLook> take_look(PoseSource& source, const std::filesystem::path& folder,
                                          std::span<const double> numbers, const PoseNotation& notation);

/// Takes a look out of the folder again.
/// @errors of the files
[[nodiscard]] Result<> drop_look(const std::filesystem::path& folder, const TakenLook& look);

}  // namespace slsd
