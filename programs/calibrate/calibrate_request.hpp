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
  std::string ruler;             ///< "NOMINAL:MEASURED" in mm, of the printed ruler; empty: true to scale
  std::string plane;             ///< the reference plane; empty: no second step
  std::string plane_ruler;       ///< like `ruler`, for the plane's print
  std::string use;               ///< "FIRST:LAST", with `from`: only these poses; empty: all
  bool force = false;            ///< replace the calibration in force even if it implies another scale of distances
  bool correct = false;          ///< with views of a board: repair the calibration in force instead of judging it
  bool gray_code = false;        ///< use a Gray code instead of the pattern
  std::filesystem::path record;  ///< folder for a session's captures; empty: beside the calibration file
  std::filesystem::path socket;  ///< socket of the service whose devices a session uses; empty: the configured devices
  bool progress = false;         ///< a session also prints what it sees in JSON, one line each
  int poses = 12;                ///< 3 to 99; number of poses in a session, including earlier recorded ones
  int planes = 3;                ///< 1 to 99; number of views of the reference plane, counted likewise
};

}  // namespace slsd
