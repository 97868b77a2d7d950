// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/calibrate/calibrate.hpp"
#include "programs/calibrate/session/pose_session.hpp"

namespace slsd {

/// The progress of a session for a page that draws it: the number of poses, and each camera's present view of the
/// board. Grids count the points seen so far in the cameras' pictures and in the projector's.
[[nodiscard]] nlohmann::json progress_json(const PoseProgress& progress);

/// The verdict on a calibration, with its reasons and what to do.
[[nodiscard]] nlohmann::json outcome_json(const CalibrationOutcome& outcome);

}  // namespace slsd
