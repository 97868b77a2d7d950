// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Draws looks at a board: make_looks DIR COUNT makes DIR/pose_NN/white.png, calibration.yml with the board's name, and
// looks.csv with the 4x4 matrix camera_from_board (mm) of each, row by row.
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include <fmt/format.h>

#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/file.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace {

using namespace slsd;

void write(const std::filesystem::path& file, const std::string& bytes) {
  const auto written = write_file_atomically(file, bytes);
  if (written) return;
  std::cerr << to_string(written.error()) << "\n";
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::filesystem::path folder = argv[1];
  Calibration rig = small_rig();
  PatternOptions options;
  options.projector_width_px = rig.projector.width_px, options.projector_height_px = rig.projector.height_px;
  const auto pattern = make_pattern(options);
  const auto board = parse_board(kSimulatedBoard);
  if (!pattern || !board) return 1;
  std::string looks;
  for (int i = 0; i < std::atoi(argv[2]); ++i) {
    const RigidTransform pose = simulated_pose(i);
    write_simulated_pose(folder / fmt::format("pose_{:02}", i), rig, *board, *pattern, pose);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) looks += fmt::format("{:.9f},", pose.rotation(row, column));
      looks += fmt::format("{:.9f},", pose.translation[row]);
    }
    looks += "0,0,0,1\n";
  }
  rig.report.board = kSimulatedBoard;
  write(folder / "calibration.yml", write_calibration(rig));
  write(folder / "looks.csv", looks);
}
