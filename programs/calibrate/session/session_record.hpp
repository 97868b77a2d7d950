// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "programs/calibrate/calibrate_request.hpp"
#include "programs/calibrate/captures/pose_observer.hpp"
#include "programs/calibrate/captures/read_captures.hpp"

namespace slsd {

/// The folder of a session's pictures: the requested one, or calibration-TIME beside the calibration file.
[[nodiscard]] std::filesystem::path record_folder(const CalibrateRequest& request, const std::filesystem::path& file);

/// Tells whether the folder holds poses, so that a session goes on with them.
[[nodiscard]] bool holds_poses(const std::filesystem::path& folder);

/// The pattern that the poses so far were taken with, or the configured one.
/// @errors of the files; kMismatch: the pattern recorded is not of the configured projector's size
[[nodiscard]] Result<Pattern> session_pattern(const std::filesystem::path& folder, const Configuration& configuration);

/// Reads the observations of the poses so far, and of the looks at the reference plane. Empty if there are none.
/// @errors of list_captures_with_planes() and read_captures(); kMismatch: the poses so far are of the other code
[[nodiscard]] Result<ReadCaptures> read_record(const std::filesystem::path& folder,
                                               const std::vector<std::string>& cameras, const ImageSize& projector,
                                               bool gray_code, PoseObservers& observers,
                                               const std::function<void(const std::string&)>& report);

}  // namespace slsd
