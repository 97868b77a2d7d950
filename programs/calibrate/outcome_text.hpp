// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// A calibration as text for a terminal: the poses, the errors, the devices, and the verdict.
[[nodiscard]] std::string outcome_text(const CalibrationOutcome& outcome);

}  // namespace slsd
