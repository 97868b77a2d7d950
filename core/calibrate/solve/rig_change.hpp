// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/calibrate/solve/bundle.hpp"

namespace slsd {

/// A moment from which on a session is another rig.
struct RigChange {
  std::size_t first_pose = 0;  ///< the first one after it
  std::string text;            ///< for a person: the moved device, the moment and the amount
};

/// Tests whether the poses before and after any moment agree on one rig: the places of all devices are let free from
/// that moment on, everything is adjusted, and the difference is held against its deviations. A board that moved
/// between its two pictures would explain a pose too; it is blamed where it explains the poses better than a device
/// does.
/// @param observations  poses in the order in which they were taken, those of the board first
/// @param options       with the noise of the corners; that of the symbols is measured anew
/// @param rig           where all poses together put it
/// @return              the most likely moment, with two poses at least on either side; nothing where there is none
/// @thread reentrant
[[nodiscard]] std::optional<RigChange> find_rig_change(const Observations& observations, const BundleOptions& options,
                                                       const RigModel& rig);

}  // namespace slsd
