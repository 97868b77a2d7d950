// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd {

inline constexpr std::size_t kPosesFileMaxBytes = 1 << 20;

/// One line of poses.csv.
struct PoseLine {
  std::string name;             ///< of the capture's folder
  std::vector<double> numbers;  ///< as the robot wrote them; may be not finite
};

/// Reads poses.csv: a line for each capture, with its folder's name and the robot's numbers. Separators are commas,
/// semicolons, spaces and tabs. Lines that begin with # are comments; the first line may be a heading.
/// @param name  for messages
/// @errors kMalformed: the message names the line; a name that comes twice; no line
/// @thread reentrant
[[nodiscard]] Result<std::vector<PoseLine>> read_poses(std::string_view text, std::string_view name);

}  // namespace slsd
