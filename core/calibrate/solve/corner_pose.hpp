// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Pose of a board at the moment its corners were seen, from these alone: symbols that were seen on it later have no
/// part.
/// @param rig    whose camera sees the corners; that with the most of them is asked
/// @param begin  rig from board, near it
/// @return       rig from board; none where fewer than 4 corners were seen
/// @thread reentrant
[[nodiscard]] std::optional<MotionVector> pose_by_corners(const PoseObservation& pose, const RigModel& rig,
                                                          const MotionVector& begin);

}  // namespace slsd
