// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/verify/verify.hpp"

namespace slsd {

/// The verdict of one view on the calibration: a line for the terminal that ends in PASS or FAIL.
[[nodiscard]] std::string check_text(const ViewCheck& check, const VerifyLimits& limits);

/// The result of all views.
[[nodiscard]] std::string summary_text(const VerifySummary& summary, const VerifyLimits& limits);

/// The advice on the faults, one sentence each.
[[nodiscard]] std::string advice(const VerifySummary& summary);

}  // namespace slsd
