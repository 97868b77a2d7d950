// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>

#include "core/result.hpp"

namespace slsd {

// What slsd does instead of serving. Each takes the configuration file that the command line names; without one,
// kConfigurationFile where that is there.

/// Writes the image that the projector shows. @errors of the configuration, the pattern and the file
[[nodiscard]] Result<> write_pattern_image(const std::optional<std::filesystem::path>& configuration_file,
                                           const std::filesystem::path& image);

/// Prints the cameras and projectors that it can see, by the names that the configuration uses.
/// @errors of the configuration
[[nodiscard]] Result<> list_devices(const std::optional<std::filesystem::path>& configuration_file);

/// Looks at everything that a scan needs and prints each finding with what to do about it.
/// @return whether a scan is possible
[[nodiscard]] bool check_everything(const std::optional<std::filesystem::path>& configuration_file);

}  // namespace slsd
