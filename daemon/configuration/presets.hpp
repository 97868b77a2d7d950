// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "core/result.hpp"

namespace slsd {

/// Presets are settings made over the socket, stored by name: {NAME: {"version": 1, "saved": TIME, "settings": {...}}},
/// with settings as of merge_settings(). They leave the calibration alone: a new one holds for every part.

/// The version of the presets that this slsd writes and reads.
inline constexpr int kPresetVersion = 1;
inline constexpr std::size_t kPresetsMax = 100;

/// The file of a configuration's presets, beside kept_settings_file(); empty without a state folder.
[[nodiscard]] std::filesystem::path presets_file(const std::filesystem::path& configuration);

/// Reads the presets. An empty object if there is no file.
/// @errors kMalformed: not in the written form; of read_file()
[[nodiscard]] Result<nlohmann::json> read_presets(const std::filesystem::path& file);
/// Writes the presets, whole or not at all.
/// @errors kNotFound: there is no state folder; of write_file_atomically()
[[nodiscard]] Result<> write_presets(const std::filesystem::path& file, const nlohmann::json& presets);

/// Checks that a name has 1 to 64 letters, digits, dots, dashes and underscores, and begins with none of the latter.
/// @errors kInvalidArgument
[[nodiscard]] Result<> check_preset_name(std::string_view name);

/// Adds or replaces a preset.
/// @param settings  those in force
/// @param now       the time, as text
/// @errors kInvalidArgument: a wrong name; kNoSpace: there are too many
[[nodiscard]] Result<nlohmann::json> with_preset(nlohmann::json presets, const std::string& name,
                                                 nlohmann::json settings, const std::string& now);

/// The settings to put into force for a preset: its own, with the calibration of those in force.
/// @errors kNotFound: no such preset; kMismatch: another version wrote it; kInvalidArgument: not settings
[[nodiscard]] Result<nlohmann::json> settings_of_preset(const nlohmann::json& presets, const std::string& name,
                                                        const nlohmann::json& in_force);

}  // namespace slsd
