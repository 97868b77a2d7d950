// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include "core/board/board.hpp"
#include "core/calibrate/calibrate.hpp"
#include "core/result.hpp"
#include "daemon/calibrate/calibrate_request.hpp"
#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// Where a calibration is to be kept: as asked for, or where the configuration has it.
/// @errors kInvalidArgument: neither says, or it is the place of the report; those of check_writable()
[[nodiscard]] Result<std::filesystem::path> file_to_keep(const CalibrateRequest& request,
                                                         const Configuration& configuration);

[[nodiscard]] CalibrateOptions calibrate_options(const Configuration& configuration);

/// Prints the result, writes the report, and keeps the calibration: last, so that where something fails what is in
/// force stays.
/// @param in_force  the calibration that a bad one, a worse one of the same devices or one of another scale must not
///                  replace, unless an output was asked for on a command line; empty: none
/// @param refused  poses that took no part, for the report
/// @errors of the files; kImpossible, kMismatch: it would replace a better one, so that what is in force stays
[[nodiscard]] Result<> finish_calibration(const CalibrateRequest& request, const std::filesystem::path& file,
                                          const std::filesystem::path& in_force, const Board& board,
                                          const std::vector<PoseReport>& refused, CalibrationOutcome outcome);

}  // namespace slsd
