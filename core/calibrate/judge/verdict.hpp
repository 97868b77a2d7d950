// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/judge/calibration_outcome.hpp"
#include "core/calibrate/judge/grade.hpp"

namespace slsd {

/// By the errors on poses held out, by how sure the depth is, and by how much of both images the poses cover.
/// @thread reentrant
[[nodiscard]] Verdict judge(const CalibrationOutcome& outcome);

}  // namespace slsd
