// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/judge/calibration_outcome.hpp"

namespace slsd {

/// A new calibration against an earlier one of the same devices.
struct RigComparison {
  /// Change of the rig since, for a person: "the projector turned by 0.30 degrees". Empty: it has not changed, within
  /// the deviations of both.
  std::string change;
  /// Growth of the distances between the devices, per cent. In a rig that has not changed, only the stated size of the
  /// board makes all of them longer by one factor.
  double longer_percent = 0;
  double longer_sigma_percent = 0;
};

/// Compares what a knock changes (where the devices are), what a lens changes (focal lengths, principal points), and
/// what a print of another size changes (distances alone), each within the deviations of both calibrations. An earlier
/// one that does not tell its deviations counts as exact as the new one.
/// @param before  of the same devices, by their names and sizes
/// @thread reentrant
[[nodiscard]] RigComparison compare_rigs(const CalibrationOutcome& outcome, const Calibration& before);

}  // namespace slsd
