// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/board/board.hpp"
#include "core/calibrate/calibrate.hpp"
#include "core/result.hpp"

namespace slsd {

/// The grade of the calibration in a file, where it is of the same cameras and projector as a new one: then a worse one
/// is no gain. Nothing where there is no such file, where it cannot be read or does not tell, or is of other devices.
[[nodiscard]] std::optional<Grade> grade_in_force(const Calibration& calibration, const std::filesystem::path& file);

/// What the calibration in force measures of the board against what was said of it, where that is another scale.
/// Nothing in the pictures themselves tells a print that is too large.
/// @return for a person, with both numbers; empty where they agree, and where none is in force that measures it
[[nodiscard]] std::string other_scale(const CalibrationOutcome& outcome, const Board& board,
                                      const std::filesystem::path& file);

/// Writes a calibration, atomically; one that was there before is kept beside it as FILE.old.
/// @return what was done, and how far the new one differs from the old one, for a person
/// @errors of the files; kMalformed: what would be written could not be read again
[[nodiscard]] Result<std::string> keep_calibration(const CalibrationOutcome& outcome,
                                                   const std::filesystem::path& file);

}  // namespace slsd
