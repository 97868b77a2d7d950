// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Draws views of a board: make_views DIR COUNT makes DIR/pose_NN/white.png, calibration.yml with the board's name, and
// views.csv with the 4x4 matrix camera_from_board (mm) of each, row by row. make_views DIR COUNT 2 makes
// DIR/pose_NN/camera/white.png and DIR/pose_NN/right/white.png, of two cameras; then views.csv has rig_from_board.
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/file.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace {

using namespace slsd;

/// A camera to the right of the rig's first, turned towards what that one sees.
CalibratedCamera right_of(const CalibratedCamera& first) {
  CalibratedCamera right = first;
  right.name = "right";
  right.rig_from_camera = {Eigen::AngleAxisd(-0.13, Eigen::Vector3d::UnitY()).toRotationMatrix(), {250, -12, 20}};
  right.projector_from_camera = first.projector_from_camera.after(right.rig_from_camera);
  return right;
}

void write_views(const std::filesystem::path& folder, const Calibration& rig, const Board& board,
                 const Pattern& pattern, const RigidTransform& rig_from_board) {
  for (const CalibratedCamera& camera : rig.cameras) {
    Calibration alone = rig;
    alone.cameras = {camera};
    write_simulated_pose(rig.cameras.size() > 1 ? folder / camera.name : folder, alone, board, pattern,
                         camera.rig_from_camera.inverse().after(rig_from_board));
  }
}

void write(const std::filesystem::path& file, const std::string& bytes) {
  const auto written = write_file_atomically(file, bytes);
  if (written) return;
  std::cerr << to_string(written.error()) << "\n";
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return 2;
  const std::filesystem::path folder = argv[1];
  Calibration rig = small_rig();
  if (argc == 4 && std::atoi(argv[3]) == 2) rig.cameras.push_back(right_of(rig.cameras[0]));
  PatternOptions options;
  options.projector_width_px = rig.projector.width_px, options.projector_height_px = rig.projector.height_px;
  const auto pattern = make_pattern(options);
  const auto board = parse_board(kSimulatedBoard);
  if (!pattern || !board) return 1;
  std::string views;
  for (int i = 0; i < std::atoi(argv[2]); ++i) {
    const RigidTransform pose = simulated_pose(i);
    write_views(folder / fmt::format("pose_{:02}", i), rig, *board, *pattern, pose);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) views += fmt::format("{:.9f},", pose.rotation(row, column));
      views += fmt::format("{:.9f},", pose.translation[row]);
    }
    views += "0,0,0,1\n";
  }
  rig.report.board = kSimulatedBoard;
  write(folder / "calibration.yml", write_calibration(rig));
  write(folder / "views.csv", views);
}
