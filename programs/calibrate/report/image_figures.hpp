// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// What a camera is called: by its name only where there are several.
/// @thread reentrant
[[nodiscard]] std::string camera_text(const CalibrationOutcome& outcome, const std::string& name);

/// Where in a camera's image, or the projector's, points were seen, a colour to each pose; cells without any are red.
/// @thread reentrant
[[nodiscard]] std::string camera_coverage_figure(const CalibrationOutcome& outcome, std::size_t camera);
[[nodiscard]] std::string projector_coverage_figure(const CalibrationOutcome& outcome);

/// By how much the calibration is off at each point, as arrows magnified; outlying points are red and take no part.
/// @thread reentrant
[[nodiscard]] std::string camera_residual_figure(const CalibrationOutcome& outcome, std::size_t camera);
[[nodiscard]] std::string projector_residual_figure(const CalibrationOutcome& outcome);

}  // namespace slsd
