// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace slsd {

// slsd's commands besides serving. Each takes the configuration file from the command line; without one,
// kConfigurationFile if it exists.

/// Writes the image that the projector shows. @errors of the configuration, the pattern and the file
[[nodiscard]] Result<> write_pattern_image(const std::optional<std::filesystem::path>& configuration_file,
                                           const std::filesystem::path& image);

/// Prints the visible cameras and projectors, with the names for the configuration.
/// @param as_json  print one JSON object; else text for people
/// @errors of the configuration
[[nodiscard]] Result<> list_devices(const std::optional<std::filesystem::path>& configuration_file, bool as_json);

/// Flashes the projector, measures the delay of each camera, prints and stores it.
/// @param output  file to write; empty: latency_file()
/// @errors of the configuration, the devices, measure_latency() and the file
[[nodiscard]] Result<> calibrate_latency(const std::optional<std::filesystem::path>& configuration_file,
                                         const std::filesystem::path& output);

/// Checks everything that a scan needs, and prints each finding with its remedy.
/// @return whether a scan is possible
[[nodiscard]] bool check_everything(const std::optional<std::filesystem::path>& configuration_file);

/// Checks only the configuration and the files that it names; opens no device and asks no service. If all is well,
/// prints that, with warnings.
/// @errors as at the service's start
[[nodiscard]] Result<> check_configuration(const std::optional<std::filesystem::path>& configuration_file);

/// Decodes the scans of a bundle again, and prints for each whether its cloud is the same.
/// @param folder  a new folder for the unpacked bundle and the clouds; empty: none
/// @errors those of read_file() and read_bundle(); kMismatch: a cloud differs; of the folder
[[nodiscard]] Result<> replay_bundle(const std::filesystem::path& bundle, const std::filesystem::path& folder);

/// The options of --print-board.
struct PrintRequest {
  std::filesystem::path file;  ///< .pdf, .svg or .png
  std::string board;           ///< see parse_board(); empty: the board that fills the paper
  std::string paper = "A4";    ///< see parse_paper()
  double dpi = 300;            ///< resolution of a PNG, 20 to 2400
};

/// Writes a calibration board for printing at true scale.
/// @errors of the board, the paper and the file; kImpossible: the board does not fit; kInvalidArgument: another type of
///         file
/// @thread reentrant
[[nodiscard]] Result<> print_board(const PrintRequest& request);

}  // namespace slsd
