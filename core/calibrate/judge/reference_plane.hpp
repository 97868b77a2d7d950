// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibrate/judge/verify.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Check of a calibration by one camera's look at the reference plane, before and after the plane took part in it. The
/// first is a check by unused data; the second is a residual.
struct PlaneCheck {
  std::string name;                        ///< the look's, "plane_00"
  std::string camera;                      ///< its name
  std::optional<ViewCheck> before, after;  ///< nothing where it cannot be measured, or was left out
};

/// Measures every look at the plane by a calibration; poses of the board are passed over.
/// @return as `before`
/// @thread reentrant
[[nodiscard]] std::vector<PlaneCheck> check_planes(const Observations& observations, const Calibration& calibration);

/// Measures them again, by the calibration that they took part in.
/// @param checks  get their `after`; those that are not among the observations do not
/// @thread reentrant
void check_again(const Observations& observations, const Calibration& calibration, std::vector<PlaneCheck>& checks);

/// All looks together.
/// @param when  &PlaneCheck::before or &PlaneCheck::after
/// @thread reentrant
[[nodiscard]] VerifySummary summarise(const std::vector<PlaneCheck>& checks,
                                      std::optional<ViewCheck> PlaneCheck::*when);

}  // namespace slsd
