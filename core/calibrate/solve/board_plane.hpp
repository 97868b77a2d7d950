// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Where a device's pixel meets the board.
/// @return mm, in the rig's frame
/// @thread reentrant
[[nodiscard]] Eigen::Vector3d meet_board(const DeviceModel& device, const RigidTransform& rig_from_board,
                                         const Eigen::Vector2d& pixel);

}  // namespace slsd
