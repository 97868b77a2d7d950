// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/usage/hand_eye_usage.hpp"

#include "clients/usage/usage.hpp"

namespace slsd {

void add_hand_eye_options(CLI::App& command, HandEyeRequest& request) {
  command.add_option("--mounted", request.mounted, "where the scanner is: on the arm, or in the cell")
      ->check(one_of({"arm", "cell"}))
      ->required();
  command.add_option("--poses", request.poses, "the notation of the robot's poses; slsctl(1) explains each")
      ->check(one_of({"ur", "ur-pendant", "kuka", "fanuc", "staubli", "kawasaki", "abb", "ros", "matrix", "matrix-m"}))
      ->required();
  command.add_option("--from", request.from, "a folder with pose_NN/white.png, and poses.csv beside them")
      ->required()
      ->type_name("FOLDER");
  command
      .add_option("--pose", request.pose,
                  "first take a picture with the service for this robot pose, and add both to the folder")
      ->expected(6, 16)
      ->delimiter(',')
      ->type_name("N,N,...");
  command.add_option("-o,--output", request.output, "the file to write (hand_eye.yml in that folder)")
      ->type_name("FILE.yml");
  command
      .add_option("--config", request.configuration_file, "the service's configuration, which names the calibration")
      ->type_name("FILE");
  command.add_flag("--service", request.from_service,
                   "take the calibration in force from the service, and propose a pose if poses are missing");
  command.add_flag("--looks", request.looks,
                   "with --json: first print an object for each view, with the board's points");
  CLI::Option* board =
      command.add_option("--board", request.board, "the board; slsd(8) lists the kinds (the calibration's)");
  command.add_option("--ruler", request.ruler, "the printed ruler's nominal and measured length, in mm")
      ->needs(board)
      ->type_name("NOMINAL:MEASURED");
  command
      .add_option("--measured", request.measured_mm,
                  "the scanner's position on the flange, measured with a ruler, in mm; detects poses of a tool instead "
                  "of the flange")
      ->expected(3)
      ->delimiter(',')
      ->type_name("X,Y,Z");
  command
      .add_option("--distance-mm", request.distance_mm,
                  "the working distance for the verdict (median distance of the boards)")
      ->check(between(10.0, 1e5))
      ->type_name("N");
  command.add_option("--without", request.without, "poses to leave out")->delimiter(',')->type_name("POSE,...");
}

}  // namespace slsd
