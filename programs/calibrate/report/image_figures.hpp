// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/calibrate/calibrate.hpp"

namespace slsd {

/// The words for a camera in texts: its own name only if there are several cameras.
/// @thread reentrant
[[nodiscard]] std::string camera_text(const CalibrationOutcome& outcome, const std::string& name);

/// Draws where points were seen in the image of a camera or the projector. Each pose has a colour; cells without points
/// are red.
/// @thread reentrant
[[nodiscard]] std::string camera_coverage_figure(const CalibrationOutcome& outcome, std::size_t camera);
[[nodiscard]] std::string projector_coverage_figure(const CalibrationOutcome& outcome);

/// Draws the calibration's error at each point, as magnified arrows. Outliers are red and were left out.
/// @thread reentrant
[[nodiscard]] std::string camera_residual_figure(const CalibrationOutcome& outcome, std::size_t camera);
[[nodiscard]] std::string projector_residual_figure(const CalibrationOutcome& outcome);

}  // namespace slsd
