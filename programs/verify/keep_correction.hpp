// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>

#include "core/result.hpp"
#include "programs/verify/verifier.hpp"

namespace slsd {

/// Corrects the calibration in force by a verifier's views of the board, if they ask for it, and prints what changed.
/// The calibration as it was before the first correction stays beside it, as FILE.uncorrected.
/// @errors those of correct_calibration() and the files; nothing is changed then
[[nodiscard]] Result<> keep_correction(const Verifier& verifier, const std::filesystem::path& file);

/// Puts the calibration of before its corrections in force again.
/// @errors kNotFound: the calibration in force was not corrected; kMismatch: the one beside it is of another date;
///         those of the configuration and the files
[[nodiscard]] Result<> undo_correction(const std::optional<std::filesystem::path>& configuration_file);

}  // namespace slsd
