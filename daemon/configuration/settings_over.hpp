// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// Settings made over the socket, which override the configuration file: {"decode": {KEY: VALUE}, "camera": {NAME:
/// {"exposure_us": N, "gain_db": N}}}. "calibration" and "pattern" have the same form; "pattern" replaces the whole
/// table. They have a file of their own, so that only the administrator writes the configuration.

/// Merges `changes` into the settings `before`. A null removes a setting, so that the configuration file's value
/// applies again.
/// @errors kInvalidArgument: another table, key or kind of value than above
/// @thread reentrant
[[nodiscard]] Result<nlohmann::json> merge_settings(nlohmann::json before, const nlohmann::json& changes);

/// Loads the configuration as load_configuration() does, then overrides its values with `settings`.
/// @errors as load_configuration(); kNotFound: no camera of this name; kInvalidArgument: no such key, or out of range
[[nodiscard]] Result<Configuration> load_configuration_with(const std::filesystem::path& file,
                                                            const nlohmann::json& settings);

/// The file that keeps a configuration's settings, in the folder of systemd's $STATE_DIRECTORY. Its name derives from
/// the configuration's, because several services may share the folder. Empty without such a folder: then nothing is
/// kept.
[[nodiscard]] std::filesystem::path kept_settings_file(const std::filesystem::path& configuration);
/// Reads the kept settings. An empty object if there is no file.
/// @errors kMalformed: not in the written form; of read_file()
[[nodiscard]] Result<nlohmann::json> read_kept_settings(const std::filesystem::path& file);
/// Finds the settings that the service kept, for other programs. For a configuration in /etc/slsd, always looks in
/// systemd's state folder. @errors as read_kept_settings()
[[nodiscard]] Result<nlohmann::json> find_kept_settings(const std::filesystem::path& configuration);
/// Names the settings: "calibration.file, camera.left.gain_db".
[[nodiscard]] std::string names_of_settings(const nlohmann::json& settings);

/// Loads the configuration as load_configuration_or_defaults() does, with the kept settings from the service's socket.
/// Skips settings that no longer fit, as the service does.
/// @param told  receives a line that names the differences from the file
[[nodiscard]] Result<Configuration> load_configuration_in_force(const std::optional<std::filesystem::path>& file,
                                                                std::ostream& told);

/// The cameras with the exposures and gains of the other list's cameras of the same names. Cameras with another driver
/// stay unchanged.
[[nodiscard]] std::vector<CameraOptions> with_exposures_of(std::vector<CameraOptions> cameras,
                                                           const std::vector<CameraOptions>& others);

}  // namespace slsd
