// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// A calibration as a page for a browser, by itself in one file, with pictures and without scripts: the verdict and
/// what to shoot next, the errors, what the poses cover, the residuals of every device, the poses in space, the depth's
/// uncertainty, each parameter with its deviation, and each pose, with the reason where it was left out.
/// @thread reentrant
[[nodiscard]] std::string report_html(const CalibrationOutcome& outcome);

}  // namespace slsd
