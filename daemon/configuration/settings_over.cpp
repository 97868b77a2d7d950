// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/settings_over.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <toml++/toml.h>

#include "core/printable.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/state_folder.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kConfigurationBytesMax = 1 << 20;
constexpr std::size_t kKeptBytesMax = 64 << 10;
constexpr std::size_t kKeysMax = 64;
constexpr std::size_t kListMax = 64;
constexpr std::array kTables{"pattern", "calibration", "decode", "cloud"};
constexpr std::array kCameraKeys{"exposure_us", "gain_db", "gain_steps"};

tl::unexpected<Error> refuse(const std::string& what) {
  return fail(ErrorCode::kInvalidArgument, what);
}

bool is_plain(const json& value) {
  return value.is_boolean() || value.is_number() || value.is_string();
}

bool is_value(const json& value) {
  return is_plain(value) || (value.is_array() && value.size() <= kListMax && std::ranges::all_of(value, is_plain));
}

Result<> merge_keys(json& before, const json& changes, const std::string& where) {
  if (!changes.is_object()) return refuse("\"" + where + "\" must be an object of keys and values");
  if (before.is_null()) before = json::object();
  for (const auto& [key, value] : changes.items()) {
    if (value.is_null()) {
      before.erase(key);
    } else if (is_value(value)) {
      before[key] = value;
    } else {
      return refuse("\"" + where + "." + printable(key, 64) + "\" must be a value as in the configuration, or null");
    }
  }
  return before.size() <= kKeysMax ? Result<>() : refuse("\"" + where + "\" has too many keys");
}

Result<> merge_camera(json& before, const json& changes, const std::string& where) {
  if (!changes.is_object()) return refuse("\"" + where + "\" must be an object of keys and values");
  for (const auto& [key, value] : changes.items()) {
    if (std::ranges::find(kCameraKeys, key) == kCameraKeys.end())
      return refuse("\"" + where + "." + printable(key, 64) +
                    "\" can only be set in the configuration file; set exposure_us, gain_db or gain_steps here");
  }
  return merge_keys(before, changes, where);
}

// Accepts a whole number in any notation: JSON has one type of number, and TOML has two. Keys for any number accept
// whole ones too, so nothing is lost.
std::optional<std::int64_t> whole_number(const json& value) {
  if (value.is_number_integer()) return value.get<std::int64_t>();
  constexpr double kExact = 9007199254740992.0;  // 2^53
  const double number = value.is_number_float() ? value.get<double>() : 0.5;
  if (std::trunc(number) != number || std::abs(number) > kExact) return std::nullopt;
  return static_cast<std::int64_t>(number);
}

template <class Insert>
void with_value(const json& value, Insert insert) {
  if (value.is_boolean()) insert(value.get<bool>());
  if (const auto whole = whole_number(value)) {
    insert(*whole);
  } else if (value.is_number_float()) {
    insert(value.get<double>());
  }
  if (value.is_string()) insert(value.get<std::string>());
}

void insert(toml::table& table, const std::string& key, const json& value) {
  with_value(value, [&](auto each) { table.insert_or_assign(key, std::move(each)); });
  if (!value.is_array()) return;
  toml::array list;
  for (const json& each : value) with_value(each, [&](auto plain) { list.push_back(std::move(plain)); });
  table.insert_or_assign(key, std::move(list));
}

toml::table* camera_named(toml::table& document, const std::string& name) {
  toml::array* const cameras = document["camera"].as_array();
  if (cameras == nullptr) return nullptr;
  for (toml::node& camera : *cameras) {
    toml::table* const table = camera.as_table();
    if (table != nullptr && (*table)["name"].value_or(std::string("camera")) == name) return table;
  }
  return nullptr;
}

}  // namespace

Result<json> merge_settings(json before, const json& changes) {
  for (const auto& [table, keys] : changes.items()) {
    Result<> merged;
    if (std::ranges::find(kTables, table) != kTables.end()) {
      merged = merge_keys(before[table], keys, table);
      if (merged && before[table].empty()) before.erase(table);
    } else if (table == "camera" && keys.is_object()) {
      for (const auto& [name, of_camera] : keys.items()) {
        json& kept = before[table][name];
        if (merged) merged = merge_camera(kept, of_camera, "camera." + printable(name, 64));
        if (kept.empty()) before[table].erase(name);
      }
      if (before.contains(table) && before[table].empty()) before.erase(table);
    } else {
      merged = refuse(
          "\"" + printable(table, 64) +
          "\" can only be set in the configuration file; set pattern, calibration, decode, cloud or camera here");
    }
    if (!merged) return tl::unexpected(merged.error());
  }
  return before;
}

Result<Configuration> load_configuration_with(const path& file, const json& settings) {
  auto plain = load_configuration(file);  // errors of the file itself refer to its own lines
  if (!plain || settings.empty()) return plain;
  const auto text = read_file(file, kConfigurationBytesMax);
  if (!text) return tl::unexpected(text.error());
  std::ostringstream merged;
  try {
    toml::table document = toml::parse(*text, file.string());
    for (const char* const name : kTables) {
      if (!settings.contains(name)) continue;
      // A pattern's keys belong together: the file's other keys could only contradict the new ones.
      if (!document.contains(name) || name == std::string_view("pattern"))
        document.insert_or_assign(name, toml::table());
      for (const auto& [key, value] : settings[name].items()) insert(*document[name].as_table(), key, value);
    }
    const json cameras = settings.value("camera", json::object());
    for (const auto& [name, keys] : cameras.items()) {
      toml::table* const camera = camera_named(document, name);
      if (camera == nullptr)
        return fail(ErrorCode::kNotFound, "no camera \"" + printable(name, 64) + "\" is configured");
      for (const auto& [key, value] : keys.items()) insert(*camera, key, value);
    }
    merged << document;
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kMalformed, std::string(error.description()), file.string());
  }
  auto configuration = read_configuration(merged.str(), file);
  if (!configuration) configuration.error().where.clear();  // refers to a line of no file
  return configuration;
}

path kept_settings_file(const path& configuration) {
  const path state = state_folder();
  return state.empty() ? state : state / ("settings-" + configuration.stem().string() + ".json");
}

Result<json> read_kept_settings(const path& file) {
  std::error_code ignored;
  if (file.empty() || !std::filesystem::exists(file, ignored)) return json::object();
  const auto text = read_file(file, kKeptBytesMax);
  if (!text) return tl::unexpected(text.error());
  const json kept = json::parse(*text, nullptr, /*allow_exceptions=*/false);
  if (!kept.is_object()) return fail(ErrorCode::kMalformed, "is not a JSON object", file.string());
  auto merged = merge_settings(json::object(), kept);
  if (!merged) merged.error().where = file.string();
  return merged;
}

Result<json> find_kept_settings(const path& configuration) {
  constexpr const char* kState = "/var/lib/slsd";  // the unit's StateDirectory=, for programs without the variable
  path file = kept_settings_file(configuration);
  std::error_code ignored;
  const path folder = std::filesystem::absolute(configuration, ignored).parent_path();
  if (file.empty() && folder == path(kConfigurationFile).parent_path())
    file = path(kState) / ("settings-" + configuration.stem().string() + ".json");
  return read_kept_settings(file);
}

std::string names_of_settings(const json& settings) {
  std::string names;
  const auto add = [&](const std::string& table, const json& keys) {
    for (const auto& [key, value] : keys.items())
      names += (names.empty() ? "" : ", ") + printable(table + "." + key, 200);
  };
  for (const auto& [table, keys] : settings.items()) {
    if (table != "camera") {
      add(table, keys);
      continue;
    }
    for (const auto& [camera, of_camera] : keys.items()) add("camera." + camera, of_camera);
  }
  return names;
}

Result<Configuration> load_configuration_in_force(const std::optional<path>& file, std::ostream& told) {
  auto configuration = load_configuration_or_defaults(file);
  const path own = file.value_or(kConfigurationFile);
  std::error_code ignored;
  if (!configuration || !std::filesystem::exists(own, ignored)) return configuration;
  const auto kept = find_kept_settings(own);
  if (kept && kept->empty()) return configuration;
  auto with_kept = kept ? load_configuration_with(own, *kept) : tl::unexpected(kept.error());
  if (!with_kept) {
    told << "warning: ignoring the settings made over the socket: " << to_string(with_kept.error()) << "\n";
    return configuration;
  }
  told << "set over the socket: " << names_of_settings(*kept) << "\n";
  return with_kept;
}

std::vector<CameraOptions> with_exposures_of(std::vector<CameraOptions> cameras,
                                             const std::vector<CameraOptions>& others) {
  for (CameraOptions& camera : cameras) {
    const auto other = std::ranges::find(others, camera.name(), [](const auto& each) { return each.name(); });
    if (other == others.end() || other->exposures_us != camera.exposures_us) continue;
    if (auto* v4l2 = std::get_if<V4l2CameraOptions>(&camera.of_driver)) {
      if (const auto* from = std::get_if<V4l2CameraOptions>(&other->of_driver))
        v4l2->exposure_us = from->exposure_us, v4l2->gain_db = from->gain_db, v4l2->gain_steps = from->gain_steps;
    } else if (auto* aravis = std::get_if<AravisCameraOptions>(&camera.of_driver)) {
      if (const auto* from = std::get_if<AravisCameraOptions>(&other->of_driver))
        aravis->exposure_us = from->exposure_us, aravis->gain_db = from->gain_db;
    }
  }
  return cameras;
}

}  // namespace slsd
