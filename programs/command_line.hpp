// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "programs/calibrate/calibrate_request.hpp"
#include "programs/calibrate/measure_extrinsics.hpp"
#include "programs/commands/commands.hpp"

namespace slsd {

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

/// The options of slsd's command line. slsd-calibrate carries out some of them.
struct CommandLine {
  std::optional<std::filesystem::path> configuration;
  std::string level = "info";
  std::filesystem::path pattern_image;
  std::filesystem::path bundle;  ///< the bundle to replay
  std::filesystem::path folder;  ///< folder for its content; empty: none
  bool check = false, check_configuration = false, list = false, as_json = false;
  bool calibrate = false, latency = false, verify = false, undo = false;
  CalibrateRequest request;
  PrintRequest print;
  ExtrinsicsRequest extrinsics;

  /// Tells whether slsd-calibrate carries out this command.
  [[nodiscard]] bool calibrates() const {
    return calibrate || verify || request.correct || !print.file.empty() || !extrinsics.file.empty();
  }
};

/// Prints the help, the version, or an error of usage.
/// @return  the command line, or the exit status
[[nodiscard]] tl::expected<CommandLine, int> parse_command_line(int argc, char** argv);

/// Prints the error of a failed command. @return the program's exit status
[[nodiscard]] int exit_status(const Result<>& result);

}  // namespace slsd
