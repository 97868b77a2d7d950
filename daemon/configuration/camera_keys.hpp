// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/toml/table_reader.hpp"
#include "daemon/configuration/camera_options.hpp"

namespace slsd {

/// Reads the [[camera]] tables. Cameras that measure points come first, then those for colour alone.
/// @param file  for error places and relative paths
/// @errors kInvalidArgument: a key that is unknown, of another driver, of the wrong type or out of range; a repeated
///         name; or no camera that measures points
/// @thread reentrant
[[nodiscard]] Result<std::vector<CameraOptions>> read_cameras(const std::vector<const toml::table*>& tables,
                                                              const std::filesystem::path& file);

/// The keys of a [[camera]] table by driver: "camera.v4l2.device".
[[nodiscard]] std::vector<std::string> known_camera_keys();

}  // namespace slsd
