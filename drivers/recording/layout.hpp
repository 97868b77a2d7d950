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

/// The cameras in `settings`, each with a safe and unique folder name.
/// @thread reentrant
[[nodiscard]] std::vector<RecordedCamera> recorded_cameras(const nlohmann::json& settings);

/// Writes a TOML configuration with which slsd replays a recording: frames through file cameras, with its pattern,
/// calibration, hand-eye calibration, and the keys of [decode] and [cloud].
/// @param settings  the answer to `settings`
/// @thread reentrant
[[nodiscard]] std::string replay_configuration(const nlohmann::json& settings,
                                               const std::vector<RecordedCamera>& cameras);

/// Makes "00000042.png": file cameras replay in order of names.
[[nodiscard]] std::string numbered(std::uint64_t number, const char* extension);

}  // namespace slsd
