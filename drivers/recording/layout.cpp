// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/recording/layout.hpp"

#include <algorithm>
#include <cstdio>

namespace slsd {
namespace {

using nlohmann::json;

constexpr int kSkewMaxMs = 10'000;  // files have no exposure; two threads may differ this much

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

// TOML writes numbers, texts and lists of them like JSON.
std::string line(const std::string& key, const json& value) {
  return key + " = " + value.dump() + "\n";
}

std::string lines(const json& table) {
  std::string text;
  for (const auto& [key, value] : table.items()) text += line(key, value);
  return text;
}

std::string camera_table(const RecordedCamera& camera) {
  return "\n[[camera]]\n" + line("name", camera.name) + line("driver", "file") + line("path", camera.folder);
}

}  // namespace

std::vector<RecordedCamera> recorded_cameras(const json& settings) {
  std::vector<RecordedCamera> cameras;
  for (const json& camera : settings.value("cameras", json::array())) {
    if (camera.value("use", "") == "texture") continue;  // it has no frame of the pattern
    const std::string name = camera.value("name", "");
    std::string folder = name;
    std::ranges::replace_if(
        folder, [](char c) { return !plain(c); }, '_');
    const auto taken = [&](const RecordedCamera& other) { return other.folder == folder; };
    while (folder.empty() || folder == "clouds" || folder == "reasons" || std::ranges::any_of(cameras, taken)) {
      folder.append("-").append(std::to_string(cameras.size()));
    }
    cameras.push_back({name, folder});
  }
  return cameras;
}

std::string replay_configuration(const json& settings, const std::vector<RecordedCamera>& cameras) {
  const json configuration = settings.value("configuration", json::object());
  std::string text = "# Replays this recording: slsd --config slsd.toml, and slsctl --socket slsd.sock scan\n";
  text += "[pattern]\n" + line("file", "pattern.toml");
  text += "\n[projector]\n" + line("driver", "headless") + lines(settings.value("projector", json::object()));
  for (const RecordedCamera& camera : cameras) text += camera_table(camera);
  text += "\n[calibration]\n" + line("file", "calibration.yml");
  text += "\n[scan]\n" + line("exposure_skew_ms", kSkewMaxMs);
  if (settings.contains("hand_eye_file")) text += "\n[frame]\n" + line("hand_eye", "hand_eye.yml");
  for (const char* table : {"decode", "cloud"}) {
    text += "\n[" + std::string(table) + "]\n" + lines(configuration.value(table, json::object()));
  }
  text += "\n[server]\n" + line("socket", "slsd.sock");
  return text;
}

std::string numbered(std::uint64_t number, const char* extension) {
  char text[32];
  std::snprintf(text, sizeof text, "%08llu%s", static_cast<unsigned long long>(number), extension);
  return text;
}

}  // namespace slsd
