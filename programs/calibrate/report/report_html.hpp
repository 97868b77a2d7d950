// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// A calibration as a single-file page for a browser, with pictures and without scripts. Contains the verdict, what to
/// capture next, the board's flatness, the errors, the coverage and the residuals of every device. Also shows the poses
/// in space, the depth's uncertainty, and each parameter with its deviation. Lists each pose, with the reason if it was
/// left out.
/// @param refused  why the calibration was refused; empty: it is in force
/// @thread reentrant
[[nodiscard]] std::string report_html(const CalibrationOutcome& outcome, const std::string& refused = {});

/// A page about a session that gave no calibration: why, and which poses were left out for which reason.
/// @thread reentrant
[[nodiscard]] std::string refusal_html(const std::string& why, const std::vector<PoseReport>& poses);

}  // namespace slsd
