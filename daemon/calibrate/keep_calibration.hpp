// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/calibrate/calibrate.hpp"
#include "core/result.hpp"

namespace slsd {

/// The grade of the calibration in a file, where it is of the same cameras and projector as a new one: then a worse one
/// is no gain. Nothing where there is no such file, where it cannot be read or does not tell, or is of other devices.
[[nodiscard]] std::optional<Grade> grade_in_force(const Calibration& calibration, const std::filesystem::path& file);

/// Writes a calibration, atomically; one that was there before is kept beside it as FILE.old.
/// @return what was done, and how far the new one differs from the old one, for a person
/// @errors of the files; kMalformed: what would be written could not be read again
[[nodiscard]] Result<std::string> keep_calibration(const CalibrationOutcome& outcome,
                                                   const std::filesystem::path& file);

}  // namespace slsd
