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

/// The file that keeps a calibration: the requested one, or the configured one.
/// @errors kInvalidArgument: neither says, or it is the place of the report; those of check_writable()
[[nodiscard]] Result<std::filesystem::path> file_to_keep(const CalibrateRequest& request,
                                                         const Configuration& configuration);

[[nodiscard]] CalibrateOptions calibrate_options(const Configuration& configuration, const Board& board);

/// Writes a page that says why a session gave no calibration: FILE-refused.html beside the file that it would be kept
/// in.
/// @param poses  that took no part, with the reasons
/// @return the error, for the caller to pass on
[[nodiscard]] Error refused(const std::filesystem::path& file, Error error, const std::vector<PoseReport>& poses);

/// Prints the result, writes the report, and keeps the calibration: last, so that if something fails what is in force
/// stays. The report of one that is refused is FILE-refused.html.
/// @param in_force  the calibration that a bad one, a worse one of the same devices or one of another scale must not
///                  replace, unless an output was asked for on a command line; empty: none
/// @param refused  poses that took no part, for the report
/// @errors of the files; kImpossible, kMismatch: it is bad, or would replace a better one of the same rig
[[nodiscard]] Result<> finish_calibration(const CalibrateRequest& request, const std::filesystem::path& file,
                                          const std::filesystem::path& in_force, const Board& board,
                                          const std::vector<PoseReport>& refused, CalibrationOutcome outcome);

}  // namespace slsd
