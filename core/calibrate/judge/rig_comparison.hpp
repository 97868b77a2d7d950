// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/judge/calibration_outcome.hpp"

namespace slsd {

/// Comparison of a new calibration with an earlier one of the same devices.
struct RigComparison {
  /// Change of the rig since then, for the user: "the projector turned by 0.30 degrees". Empty: no change beyond the
  /// deviations of both.
  std::string change;
  /// Growth of the distances between the devices, per cent. In an unchanged rig, only another stated size of the board
  /// makes all of them longer by one factor.
  double longer_percent = 0;
  double longer_sigma_percent = 0;
};

/// Compares the places of the devices, which a knock changes, and the focal lengths and principal points, which a lens
/// changes. A print of another size changes distances alone. Each is compared with the deviations of both calibrations.
/// If the earlier one has no deviations, it counts as exact as the new one.
/// @param before  an earlier calibration of the same devices, by their names and sizes
/// @thread reentrant
[[nodiscard]] RigComparison compare_rigs(const CalibrationOutcome& outcome, const Calibration& before);

}  // namespace slsd
