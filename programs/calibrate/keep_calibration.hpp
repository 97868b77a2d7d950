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

/// The calibration in the file that a new one would replace. Nothing if the file is missing or unreadable, or belongs
/// to other cameras or another projector.
[[nodiscard]] std::optional<Calibration> calibration_in_force(const Calibration& calibration,
                                                              const std::filesystem::path& file);

/// Compares a calibration with the one in force: objections to a replacement, and changes of the rig.
/// @param board       as the user described it
/// @errors kMismatch: the same rig, but the one in force implies another scale of the board, with both numbers;
///         kImpossible: the same rig, and the one in force is better
/// @return the changes of the rig, in words; empty: none
[[nodiscard]] Result<std::string> compare_with_force(const CalibrationOutcome& outcome, const Board& board,
                                                     const Calibration& before, bool force);

/// Writes a calibration atomically and keeps the previous one beside it as FILE.old.
/// @return in words: what was done, and how far the new one differs from the old one
/// @errors of the files; kMalformed: the text to write could not be read again
[[nodiscard]] Result<std::string> keep_calibration(const CalibrationOutcome& outcome,
                                                   const std::filesystem::path& file);

}  // namespace slsd
