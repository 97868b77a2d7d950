// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// Draws the devices and the used poses from above and from the right, in the rig's frame.
/// @thread reentrant
[[nodiscard]] std::string poses_from_above(const CalibrationOutcome& outcome);
[[nodiscard]] std::string poses_from_the_right(const CalibrationOutcome& outcome);

/// Draws the board's shape: the distance of each point from the board's plane.
/// @return empty if no board was seen
/// @thread reentrant
[[nodiscard]] std::string board_figure(const CalibrationOutcome& outcome);

/// Draws the possible error of depth over the working range.
/// @return empty if it is unknown
/// @thread reentrant
[[nodiscard]] std::string depth_figure(const CalibrationOutcome& outcome);

}  // namespace slsd
