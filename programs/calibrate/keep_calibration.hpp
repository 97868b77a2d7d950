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

/// The calibration in a file that a new one would replace: nothing if there is no such file, if it cannot be read, or
/// if it is of other cameras or another projector.
[[nodiscard]] std::optional<Calibration> calibration_in_force(const Calibration& calibration,
                                                              const std::filesystem::path& file);

/// Compares a calibration with the one in force: objections to replacing that, and what has changed since.
/// @param board       as it was said to be
/// @errors kMismatch: the rig is the same, and the board is of another scale by the one in force, with both numbers;
///         kImpossible: the rig is the same, and the one in force is better
/// @return how the rig has changed, for a person; empty: it has not
[[nodiscard]] Result<std::string> compare_with_force(const CalibrationOutcome& outcome, const Board& board,
                                                     const Calibration& before, bool force);

/// Writes a calibration, atomically; one that was there before is kept beside it as FILE.old.
/// @return what was done, and how far the new one differs from the old one, for a person
/// @errors of the files; kMalformed: what would be written could not be read again
[[nodiscard]] Result<std::string> keep_calibration(const CalibrationOutcome& outcome,
                                                   const std::filesystem::path& file);

}  // namespace slsd
