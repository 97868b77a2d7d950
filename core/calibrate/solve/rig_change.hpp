// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/calibrate/solve/bundle.hpp"

namespace slsd {

/// A moment during a session at which the rig changed.
struct RigChange {
  std::size_t first_pose = 0;  ///< the first pose after it
  std::string text;            ///< for the user: the moved device, the moment and the amount
};

/// Tests whether the poses before and after any moment agree on one rig. The places of all devices are free from that
/// moment on, everything is adjusted, and the difference is compared with its deviations. A board that moved between
/// its two pictures would also explain a pose; it is reported if it explains the poses better than a device does.
/// @param observations  poses in the order in which they were taken, those of the board first
/// @param options       with the noise of the corners; that of the symbols is measured again
/// @param rig           its estimate from all poses together
/// @return              the most likely moment, with at least two poses on either side; empty if there is none
/// @thread reentrant
[[nodiscard]] std::optional<RigChange> find_rig_change(const Observations& observations, const BundleOptions& options,
                                                       const RigModel& rig);

}  // namespace slsd
