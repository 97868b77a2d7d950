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

/// Settings that were set over the socket, over those of the configuration file:
/// {"decode": {KEY: VALUE}, "camera": {NAME: {"exposure_us": N, "gain_db": N}}}, and the same with "calibration" and
/// "pattern", which stands in the place of the whole table. They are kept in a file of their own, so that nobody but
/// the administrator writes the configuration.

/// Merges `changes` into the settings `before`. A null removes a setting, so that the configuration file's is in force
/// again.
/// @errors kInvalidArgument: another table, key or kind of value than above
/// @thread reentrant
[[nodiscard]] Result<nlohmann::json> merge_settings(nlohmann::json before, const nlohmann::json& changes);

/// Loads the configuration as load_configuration() does, then replaces its values by `settings`.
/// @errors as load_configuration(); kNotFound: no camera of a name; kInvalidArgument: no such key, or out of range
[[nodiscard]] Result<Configuration> load_configuration_with(const std::filesystem::path& file,
                                                            const nlohmann::json& settings);

/// The file that keeps a configuration's settings, in the folder of systemd's $STATE_DIRECTORY. Its name comes from the
/// configuration's, as several services may share the folder. Empty if there is no such folder: nothing is kept.
[[nodiscard]] std::filesystem::path kept_settings_file(const std::filesystem::path& configuration);
/// Reads the kept settings. An empty object if there is no file.
/// @errors kMalformed: it is not what was written; of read_file()
[[nodiscard]] Result<nlohmann::json> read_kept_settings(const std::filesystem::path& file);
/// Finds the settings that the service kept, for other programs. Looks where systemd keeps the state of a configuration
/// in /etc/slsd, whoever asks. @errors as read_kept_settings()
[[nodiscard]] Result<nlohmann::json> find_kept_settings(const std::filesystem::path& configuration);
/// "calibration.file, camera.left.gain_db"
[[nodiscard]] std::string names_of_settings(const nlohmann::json& settings);

/// Loads the configuration as load_configuration_or_defaults() does, with the settings that were set over the service's
/// socket and kept. Skips settings that no longer fit, as the service does.
/// @param told  gets a line that says what is not as the file has it
[[nodiscard]] Result<Configuration> load_configuration_in_force(const std::optional<std::filesystem::path>& file,
                                                                std::ostream& told);

/// The same cameras with exposures and gains as those of their names have them; as they are where the drivers differ.
[[nodiscard]] std::vector<CameraOptions> with_exposures_of(std::vector<CameraOptions> cameras,
                                                           const std::vector<CameraOptions>& others);

}  // namespace slsd
