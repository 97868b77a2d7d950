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

/// A view that was added to a folder.
struct TakenView {
  std::string name;                         ///< of the new capture
  std::optional<std::string> lines_before;  ///< of poses.csv; empty: there was no such file
};

/// Takes a picture of the board under white light with each camera, and adds it to a folder, with a line for the
/// robot's pose in poses.csv. After an error the folder's views are as they were.
/// @param numbers  of the robot's pose
/// @errors those of read_robot_pose(), of the source and of the files
[[nodiscard]] Result<TakenView> take_view(PoseSource& source, const std::filesystem::path& folder,
                                          std::span<const double> numbers, const PoseNotation& notation);

/// Takes a view out of the folder again.
/// @errors of the files
[[nodiscard]] Result<> drop_view(const std::filesystem::path& folder, const TakenView& view);

}  // namespace slsd
