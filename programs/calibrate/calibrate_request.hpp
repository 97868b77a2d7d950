// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace slsd {

/// The options of `slsd --calibrate` from its command line.
struct CalibrateRequest {
  std::optional<std::filesystem::path> configuration_file;
  std::filesystem::path from;    ///< a folder of captures; empty: the configured devices
  std::filesystem::path output;  ///< empty: the configured calibration file
  std::string board;             ///< empty: the default board
  std::string ruler;             ///< "NOMINAL:MEASURED" in mm, as the print's ruler was measured; empty: true to scale
  std::string plane;             ///< the reference plane; empty: no second step
  std::string plane_ruler;       ///< like `ruler`, of the plane's print
  std::string use;               ///< "FIRST:LAST", with `from`: the poses of that part; empty: all
  bool force = false;            ///< replaces the calibration in force though distances are of another scale by it
  bool gray_code = false;        ///< instead of the pattern
  std::filesystem::path record;  ///< destination of a session's captures; empty: beside the calibration file
  std::filesystem::path socket;  ///< socket of the service whose devices a session uses; empty: the configured devices
  bool progress = false;         ///< a session tells what it sees in JSON, too, a line each
  int poses = 12;                ///< 3 to 99; how many poses a session takes, those recorded before among them
  int planes = 3;                ///< 1 to 99; how many looks at the reference plane it takes, likewise
};

}  // namespace slsd
