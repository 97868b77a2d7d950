// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"

namespace slsd {

/// The pattern recorded beside the captures as pattern.toml, or else the configured one.
/// @errors of the file, read_pattern() and configured_pattern()
[[nodiscard]] Result<Pattern> captured_pattern(const std::filesystem::path& folder, const Configuration& configuration);

/// Tells whether the poses have pictures of a Gray code, and none of the pattern.
[[nodiscard]] bool captured_in_gray(const std::vector<CapturedPose>& poses);

}  // namespace slsd
