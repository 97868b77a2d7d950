// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/observe/observations.hpp"

namespace slsd {

/// Faults that exclude a view whatever the others show. After one, a session takes the pose again, and a calibration
/// leaves it out. The text is for the user, with the figure and what to do; empty without a fault.

/// Describes a lack of corners. A view needs enough of them, in at least two rows and two columns of two or more each:
/// fewer fit any pose.
/// @thread reentrant
[[nodiscard]] std::string lack_of_corners(const PoseView& view);

/// @param symbols  read on the board by one camera
/// @thread reentrant
[[nodiscard]] std::string lack_of_symbols(std::size_t symbols);

/// @param clipped_share  share of the board's pixels that are saturated
/// @thread reentrant
[[nodiscard]] std::string excess_of_light(double clipped_share);

/// Tells whether the blur exceeds that of the other poses by so much that it displaces corners and symbols.
/// @param usual_px  0: there are no other poses
/// @thread reentrant
[[nodiscard]] bool is_blurred(double blur_px, double usual_px);

}  // namespace slsd
