// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace slsd {

/// A camera of a recording, and the folder of its frames.
struct RecordedCamera {
  std::string name;
  std::string folder;
};

/// The cameras that `settings` names, each with a folder whose name is safe and its own.
/// @thread reentrant
[[nodiscard]] std::vector<RecordedCamera> recorded_cameras(const nlohmann::json& settings);

/// A configuration, as TOML, with which slsd replays a recording: its frames by file cameras, its pattern and its
/// calibration beside it, its keys of [decode].
/// @param settings  what `settings` answered
/// @thread reentrant
[[nodiscard]] std::string replay_configuration(const nlohmann::json& settings,
                                               const std::vector<RecordedCamera>& cameras);

/// "00000042.png": file cameras replay by name.
[[nodiscard]] std::string numbered(std::uint64_t number, const char* extension);

}  // namespace slsd
