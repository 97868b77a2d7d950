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

/// Tells whether the folder contains poses, so that a session continues them.
[[nodiscard]] bool holds_poses(const std::filesystem::path& folder);

/// The pattern of the earlier poses, or else the configured one.
/// @errors of the files; kMismatch: the recorded pattern is for another projector size
[[nodiscard]] Result<Pattern> session_pattern(const std::filesystem::path& folder, const Configuration& configuration);

/// Reads the observations of the earlier poses, and of the views of the reference plane. Empty if there are none.
/// @errors of list_captures_with_planes() and read_captures(); kMismatch: the earlier poses use the other code
[[nodiscard]] Result<ReadCaptures> read_record(const std::filesystem::path& folder,
                                               const std::vector<std::string>& cameras, const ImageSize& projector,
                                               bool gray_code, PoseObservers& observers,
                                               const std::function<void(const std::string&)>& report);

}  // namespace slsd
