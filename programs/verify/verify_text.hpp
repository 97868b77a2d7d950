// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/judge/verify.hpp"

namespace slsd {

/// The verdict of one look on the calibration, for a person at a terminal: a line, with PASS or FAIL at its end.
[[nodiscard]] std::string check_text(const ViewCheck& check, const VerifyLimits& limits);

/// All looks together.
[[nodiscard]] std::string summary_text(const VerifySummary& summary, const VerifyLimits& limits);

/// The advice on the faults, a sentence to each.
[[nodiscard]] std::string advice(const VerifySummary& summary);

}  // namespace slsd
