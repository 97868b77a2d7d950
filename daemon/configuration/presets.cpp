// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/presets.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/state_folder.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kPresetsBytesMax = 4 << 20;
constexpr std::size_t kNameMax = 64;

bool is_name_letter(char letter) {
  const auto in = [letter](char first, char last) { return letter >= first && letter <= last; };
  return in('a', 'z') || in('A', 'Z') || in('0', '9') || letter == '.' || letter == '-' || letter == '_';
}

}  // namespace

path presets_file(const path& configuration) {
  const path state = state_folder();
  return state.empty() ? state : state / ("presets-" + configuration.stem().string() + ".json");
}

Result<json> read_presets(const path& file) {
  std::error_code ignored;
  if (file.empty() || !std::filesystem::exists(file, ignored)) return json::object();
  const auto text = read_file(file, kPresetsBytesMax);
  if (!text) return tl::unexpected(text.error());
  json presets = json::parse(*text, nullptr, /*allow_exceptions=*/false);
  if (presets.is_object()) return presets;
  return fail(ErrorCode::kMalformed, "is not a JSON object: move this file away, and save the presets again",
              file.string());
}

Result<> write_presets(const path& file, const json& presets) {
  if (file.empty())
    return fail(ErrorCode::kNotFound, "$STATE_DIRECTORY is not set, so there is no place to keep presets");
  return write_file_atomically(file, presets.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

Result<> check_preset_name(std::string_view name) {
  const bool plain = !name.empty() && name.size() <= kNameMax && std::ranges::all_of(name, is_name_letter) &&
                     name.front() != '.' && name.front() != '-' && name.front() != '_';
  if (plain) return {};
  return fail(ErrorCode::kInvalidArgument,
              "\"" + printable(name, kNameMax) +
                  "\" is not a valid preset name: use 1 to 64 letters, digits, dots, dashes and underscores");
}

Result<json> with_preset(json presets, const std::string& name, json settings, const std::string& now) {
  if (auto plain = check_preset_name(name); !plain) return tl::unexpected(plain.error());
  if (!presets.contains(name) && presets.size() >= kPresetsMax)
    return fail(ErrorCode::kNoSpace, "there are " + std::to_string(presets.size()) + " presets: delete one first");
  settings.erase("calibration");
  presets[name] = {{"version", kPresetVersion}, {"saved", now}, {"settings", std::move(settings)}};
  return presets;
}

Result<json> settings_of_preset(const json& presets, const std::string& name, const json& in_force) {
  const auto found = presets.find(name);
  if (found == presets.end()) {
    std::vector<std::string> names;
    for (const auto& [each, preset] : presets.items()) names.push_back(each);
    return fail(ErrorCode::kNotFound, "there is no preset \"" + printable(name, kNameMax) + "\"" +
                                          nearest_hint(name, names) + (names.empty() ? ": none is saved" : ""));
  }
  const json version = found->is_object() ? found->value("version", json()) : json();
  if (version != kPresetVersion)
    return fail(ErrorCode::kMismatch, "the preset \"" + printable(name, kNameMax) + "\" has version " +
                                          printable(version.dump(), kNameMax) + ", and this slsd reads version " +
                                          std::to_string(kPresetVersion) + ": save it again");
  const json kept = found->value("settings", json());
  auto settings = kept.is_object() && !kept.contains("calibration")
                      ? merge_settings(json::object(), kept)
                      : fail(ErrorCode::kInvalidArgument, "it has no settings");
  if (!settings) {
    settings.error().message =
        "the preset \"" + printable(name, kNameMax) + "\" cannot be used: " + settings.error().message;
    return settings;
  }
  if (in_force.contains("calibration")) (*settings)["calibration"] = in_force["calibration"];
  return settings;
}

}  // namespace slsd
