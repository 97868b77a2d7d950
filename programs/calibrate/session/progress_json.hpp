// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/calibrate/calibrate.hpp"
#include "programs/calibrate/session/pose_session.hpp"

namespace slsd {

/// What a page draws of a session: how many poses there are, what each camera sees now, and where in its picture, and
/// in the projector's, points were seen so far, as counts in a grid.
[[nodiscard]] nlohmann::json progress_json(const PoseProgress& progress);

/// The verdict on a calibration, with its reasons and what to do.
[[nodiscard]] nlohmann::json outcome_json(const CalibrationOutcome& outcome);

}  // namespace slsd
