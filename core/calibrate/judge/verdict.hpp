// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/calibrate/judge/calibration_outcome.hpp"
#include "core/calibrate/judge/grade.hpp"

namespace slsd {

/// Judges a calibration by its errors on held-out poses, by the uncertainty of depth, and by the poses' coverage of
/// both images.
/// @param depth_min_mm, depth_max_mm  the working range, in which at least one of the boards should be
/// @thread reentrant
[[nodiscard]] Verdict judge(const CalibrationOutcome& outcome, double depth_min_mm, double depth_max_mm);

}  // namespace slsd
