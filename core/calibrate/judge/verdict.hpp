// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/judge/calibration_outcome.hpp"
#include "core/calibrate/judge/grade.hpp"

namespace slsd {

/// Judges a calibration by its errors on held-out poses, by the uncertainty of depth, and by the poses' coverage of
/// both images.
/// @thread reentrant
[[nodiscard]] Verdict judge(const CalibrationOutcome& outcome);

}  // namespace slsd
