// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Pose of a board when its corners were seen, from these alone, without symbols that were seen on it later.
/// @param rig    used for the camera with the most corners
/// @param begin  rig from board, near the solution
/// @return       rig from board; empty if fewer than 4 corners were seen
/// @thread reentrant
[[nodiscard]] std::optional<MotionVector> pose_by_corners(const PoseObservation& pose, const RigModel& rig,
                                                          const MotionVector& begin);

}  // namespace slsd
