// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/code/pattern.hpp"
#include "core/decode/options.hpp"
#include "core/result.hpp"
#include "daemon/configuration/black_box_options.hpp"
#include "daemon/configuration/camera_options.hpp"
#include "daemon/configuration/cloud_options.hpp"
#include "daemon/configuration/frame_options.hpp"
#include "daemon/configuration/projector_options.hpp"
#include "daemon/configuration/scan_options.hpp"
#include "daemon/configuration/server_options.hpp"

namespace slsd {

inline constexpr const char* kConfigurationFile = "/etc/slsd/slsd.toml";

/// The fate of a scan whose camera or projector is not the calibrated one.
enum class OtherHardware { kError, kWarn };

/// The configuration file's content, one member for each table. Relative paths are joined to the file's folder.
struct Configuration {
  std::filesystem::path pattern_file;  ///< replaces `pattern` unless it is empty
  PatternOptions pattern;              ///< includes the projector's size and the named symbols
  ProjectorOptions projector;
  std::vector<CameraOptions> cameras;      ///< those that measure points first
  std::filesystem::path calibration_file;  ///< empty: none, and no scan is possible
  OtherHardware other_hardware = OtherHardware::kError;
  DecodeOptions decode;
  FrameOptions frame;
  CloudOptions cloud;
  ScanOptions scan;
  ServerOptions server;
  BlackBoxOptions black_box;
  nlohmann::json given = nlohmann::json::object();  ///< the keys as in the file, by table, for the record
};

/// Reads a configuration's text.
/// @param file  its path, for error places and relative paths
/// @errors kMalformed: not TOML; kInvalidArgument: a key that is unknown, of the wrong type or out of range. The place
///         is file:line:column
/// @thread reentrant
[[nodiscard]] Result<Configuration> read_configuration(std::string_view text, const std::filesystem::path& file);

/// The keys that read_configuration() knows: "projector.width_px", and of cameras by driver: "camera.v4l2.device".
[[nodiscard]] std::vector<std::string> known_keys();

/// All keys of [decode] and of [cloud] with the values in force, from any source: read_configuration() reads them
/// again.
[[nodiscard]] nlohmann::json decode_keys(DecodeOptions options);
[[nodiscard]] nlohmann::json cloud_keys(CloudOptions options);

/// Reads a configuration file. @errors as above, and those of read_file() @thread reentrant
[[nodiscard]] Result<Configuration> load_configuration(const std::filesystem::path& file);

/// Loads the given file; without one, kConfigurationFile if it exists, else the defaults. For commands that work before
/// slsd is configured.
/// @errors as load_configuration()
[[nodiscard]] Result<Configuration> load_configuration_or_defaults(const std::optional<std::filesystem::path>& file);

}  // namespace slsd
