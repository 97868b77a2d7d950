// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace slsd {

/// The options of `slsctl hand-eye`.
struct HandEyeRequest {
  std::optional<std::filesystem::path> configuration_file;
  std::string mounted;                ///< "arm" or "cell"
  std::string poses;                  ///< the robot's notation, as of pose_notation()
  std::filesystem::path from;         ///< a folder of captures with poses.csv
  std::filesystem::path output;       ///< the file to write
  std::string board, ruler;           ///< as for slsd --calibrate; empty: the calibration's board
  std::vector<double> measured_mm;    ///< x y z of the scanner on the flange by a ruler; empty: unknown
  std::optional<double> distance_mm;  ///< working distance for the verdict; empty: that of the boards
  std::vector<std::string> without;   ///< names of poses to leave out
  std::vector<double> pose;           ///< the robot's numbers: takes a picture with the service first; empty: none
  std::filesystem::path socket;       ///< the service's; with `pose` or `from_service`
  bool from_service = false;          ///< takes the calibration in force from the service, also without `pose`
  bool looks = false;                 ///< with `json`: prints an object for each view first
  bool json = false;
};

/// Adds the options. slsctl checks them; slsd-hand-eye, which it starts, carries them out.
void add_hand_eye_options(CLI::App& command, HandEyeRequest& request);

inline constexpr const char* kHandEyeProgram = "slsd-hand-eye";
inline constexpr const char* kHandEyePurpose = "calibrate the scanner's pose on a robot's arm or in its cell";
inline constexpr const char* kHandEyeExamples =
    "  slsctl hand-eye --mounted arm --poses ur --from captures\n"
    "  slsctl hand-eye --mounted cell --poses kuka --from captures -o hand_eye.yml\n"
    "  slsctl hand-eye --mounted arm --poses ur --from captures --pose=0.41,-0.23,0.61,2.9,0.12,0.04\n";

}  // namespace slsd
