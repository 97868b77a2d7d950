// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace slsd {

// What slsd does instead of serving. Each takes the configuration file that the command line names; without one,
// kConfigurationFile where that is there.

/// Writes the image that the projector shows. @errors of the configuration, the pattern and the file
[[nodiscard]] Result<> write_pattern_image(const std::optional<std::filesystem::path>& configuration_file,
                                           const std::filesystem::path& image);

/// Prints the cameras and projectors that it can see, by the names that the configuration uses.
/// @param as_json  one JSON object, else text for people
/// @errors of the configuration
[[nodiscard]] Result<> list_devices(const std::optional<std::filesystem::path>& configuration_file, bool as_json);

/// Flashes the projector, measures how late each camera sees it, prints that and keeps it.
/// @param output  where it is kept; empty: latency_file()
/// @errors of the configuration, the devices, measure_latency() and the file
[[nodiscard]] Result<> calibrate_latency(const std::optional<std::filesystem::path>& configuration_file,
                                         const std::filesystem::path& output);

/// Looks at everything that a scan needs and prints each finding with what to do about it.
/// @return whether a scan is possible
[[nodiscard]] bool check_everything(const std::optional<std::filesystem::path>& configuration_file);

/// Looks at the configuration alone, and the files that it names: it opens no device, and asks no service. Prints that
/// all is well, with warnings, where it is.
/// @errors as the service's start has them
[[nodiscard]] Result<> check_configuration(const std::optional<std::filesystem::path>& configuration_file);

/// Decodes the scans of a bundle anew, and prints for each whether its cloud is the same.
/// @param folder  a new one, which the bundle is unpacked into and the clouds are written to; empty: none
/// @errors those of read_file() and read_bundle(); kMismatch: a cloud differs; of the folder
[[nodiscard]] Result<> replay_bundle(const std::filesystem::path& bundle, const std::filesystem::path& folder);

/// The options of --print-board.
struct PrintRequest {
  std::filesystem::path file;  ///< .pdf, .svg or .png
  std::string board;           ///< see parse_board(); empty: the board that fills the paper
  std::string paper = "A4";    ///< see parse_paper()
  double dpi = 300;            ///< resolution of a PNG, 20 to 2400
};

/// Writes a board for calibrating, to be printed to true scale.
/// @errors of the board, the paper and the file; kImpossible where the board does not fit, kInvalidArgument of another
///         kind of file
/// @thread reentrant
[[nodiscard]] Result<> print_board(const PrintRequest& request);

}  // namespace slsd
