// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// The devices and the poses that were used, from above and from the right, in the rig's frame.
/// @thread reentrant
[[nodiscard]] std::string poses_from_above(const CalibrationOutcome& outcome);
[[nodiscard]] std::string poses_from_the_right(const CalibrationOutcome& outcome);

/// The board's shape: how far each place lies off the board's plane.
/// @return empty where nothing of the board was seen
/// @thread reentrant
[[nodiscard]] std::string board_figure(const CalibrationOutcome& outcome);

/// Draws the possible error of a depth, over the working range.
/// @return empty where it is not known
/// @thread reentrant
[[nodiscard]] std::string depth_figure(const CalibrationOutcome& outcome);

}  // namespace slsd
