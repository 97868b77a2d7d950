// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// Lacks that keep a view from taking part, whatever others show. A session uses them to take the pose again, and a
/// calibration to leave it out. They are for a person, with the figure and what to do; empty if the view lacks nothing.

/// Corners: enough of them, in two rows and two columns of two or more each, without which they fit any pose.
/// @thread reentrant
[[nodiscard]] std::string lack_of_corners(const PoseView& view);

/// @param symbols  read on the board by one camera
/// @thread reentrant
[[nodiscard]] std::string lack_of_symbols(std::size_t symbols);

/// @param clipped_share  of the board's pixels, those at full level
/// @thread reentrant
[[nodiscard]] std::string excess_of_light(double clipped_share);

/// Tells whether a blur is so far above that of the other poses that it moves corners and symbols.
/// @param usual_px  0: there are none
/// @thread reentrant
[[nodiscard]] bool is_blurred(double blur_px, double usual_px);

}  // namespace slsd
