// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include "core/board/board.hpp"
#include "core/calibrate/calibrate.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// The calibration's file: the requested one, or the configured one.
/// @errors kInvalidArgument: neither is given, or the report would use the same path; those of check_writable()
[[nodiscard]] Result<std::filesystem::path> file_to_keep(const CalibrateRequest& request,
                                                         const Configuration& configuration);

[[nodiscard]] CalibrateOptions calibrate_options(const Configuration& configuration, const Board& board);

/// Writes a page that explains why a session gave no calibration: FILE-refused.html beside the intended file.
/// @param poses  those left out, with the reasons
/// @return the error, for the caller to return
[[nodiscard]] Error refused(const std::filesystem::path& file, Error error, const std::vector<PoseReport>& poses);

/// Prints the result, writes the report, and keeps the calibration: last, so that on an error the one in force stays.
/// The report of a refused calibration is FILE-refused.html.
/// @param in_force  the calibration to protect, unless the command line requested an output. A bad one, a worse one of
///                  the same devices, or one of another scale must not replace it; empty: none
/// @param refused  poses left out, for the report
/// @errors of the files; kImpossible, kMismatch: the new calibration is bad, or would replace a better one of the same
///         rig
[[nodiscard]] Result<> finish_calibration(const CalibrateRequest& request, const std::filesystem::path& file,
                                          const std::filesystem::path& in_force, const Board& board,
                                          const std::vector<PoseReport>& refused, CalibrationOutcome outcome);

}  // namespace slsd
