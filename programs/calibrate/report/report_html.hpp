// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// A calibration as a page for a browser, by itself in one file, with pictures and without scripts: the verdict and
/// what to shoot next, how flat the board is, the errors, what the poses cover, the residuals of every device, the
/// poses in space, the depth's uncertainty, each parameter with its deviation, and each pose, with the reason where it
/// was left out.
/// @param refused  why it was not put in force; empty: it was
/// @thread reentrant
[[nodiscard]] std::string report_html(const CalibrationOutcome& outcome, const std::string& refused = {});

/// A session that gave no calibration, as a page: why, and which poses took no part for which reason.
/// @thread reentrant
[[nodiscard]] std::string refusal_html(const std::string& why, const std::vector<PoseReport>& poses);

}  // namespace slsd
