// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// Settings that were set over the socket, over those of the configuration file:
/// {"decode": {KEY: VALUE}, "camera": {NAME: {"exposure_us": N, "gain_db": N}}}, and the same with "calibration" and
/// "pattern", which stands in the place of the whole table. They are kept in a file of their own, so that nobody but
/// the administrator writes the configuration.

/// Those before, with others set; null takes one away, and the configuration file's is in force again.
/// @errors kInvalidArgument: another table, key or kind of value than above
/// @thread reentrant
[[nodiscard]] Result<nlohmann::json> merge_settings(nlohmann::json before, const nlohmann::json& changes);

/// As load_configuration(), with the settings in the places of its own.
/// @errors as load_configuration(); kNotFound: no camera of a name; kInvalidArgument: no such key, or out of range
[[nodiscard]] Result<Configuration> load_configuration_with(const std::filesystem::path& file,
                                                            const nlohmann::json& settings);

/// Where the settings of a configuration are kept: in the folder of systemd's $STATE_DIRECTORY, by the configuration's
/// name, as several services may share the folder. Empty where there is no such folder, and nothing is kept.
[[nodiscard]] std::filesystem::path kept_settings_file(const std::filesystem::path& configuration);
/// What is kept there; nothing where there is no file.
/// @errors kMalformed: it is not what was written; of read_file()
[[nodiscard]] Result<nlohmann::json> read_kept_settings(const std::filesystem::path& file);

/// The same cameras with exposures and gains as those of their names have them; as they are where the drivers differ.
[[nodiscard]] std::vector<CameraOptions> with_exposures_of(std::vector<CameraOptions> cameras,
                                                           const std::vector<CameraOptions>& others);

}  // namespace slsd
