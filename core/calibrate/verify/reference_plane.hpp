// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/verify/verify.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Check of a calibration by one camera's view of the reference plane, before and after the plane took part in it. The
/// first check uses independent data; the second is a residual.
struct PlaneCheck {
  std::string name;                        ///< name of the view, "plane_00"
  std::string camera;                      ///< name of the camera
  std::optional<ViewCheck> before, after;  ///< empty if it cannot be measured or was left out
};

/// Measures every view of the plane by a calibration; skips poses of the board.
/// @return the checks with `before` filled in
/// @thread reentrant
[[nodiscard]] std::vector<PlaneCheck> check_planes(const Observations& observations, const Calibration& calibration);

/// Measures the views again, by the calibration that includes them.
/// @param checks  get their `after`, except views that are not among the observations
/// @thread reentrant
void check_again(const Observations& observations, const Calibration& calibration, std::vector<PlaneCheck>& checks);

/// Summarises all views.
/// @param when  &PlaneCheck::before or &PlaneCheck::after
/// @thread reentrant
[[nodiscard]] VerifySummary summarise(const std::vector<PlaneCheck>& checks,
                                      std::optional<ViewCheck> PlaneCheck::*when);

}  // namespace slsd
