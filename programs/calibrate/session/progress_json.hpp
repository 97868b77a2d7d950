// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/calibrate/calibrate.hpp"
#include "programs/calibrate/session/pose_session.hpp"

namespace slsd {

/// The progress of a session for a page: the number of poses, and each camera's current view of the board. Grids count
/// the points seen so far in the pictures of the cameras and the projector.
[[nodiscard]] nlohmann::json progress_json(const PoseProgress& progress);

/// The verdict on a calibration, with its reasons and advice.
[[nodiscard]] nlohmann::json outcome_json(const CalibrationOutcome& outcome);

}  // namespace slsd
