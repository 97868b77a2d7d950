// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/programs/calibrate/simulated_captures.hpp"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/board/board_ink.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr double kPaper = 0.9, kInk = 0.12;
constexpr int kDotsPerMm = 8;

/// What is printed, so finely that a dot is a twentieth of a camera pixel.
Grey8 print(const Board& board) {
  Grey8 dots(static_cast<int>(board.width_mm() * kDotsPerMm), static_cast<int>(board.height_mm() * kDotsPerMm), 255);
  for (const InkRectangle& ink : ink_of(board).rectangles) {
    const auto dot = [](double mm) { return static_cast<int>(std::lround(mm * kDotsPerMm)); };
    for (int y = dot(ink.y_mm); y < dot(ink.y_mm + ink.height_mm); ++y) {
      std::fill(dots.row(y) + dot(ink.x_mm), dots.row(y) + dot(ink.x_mm + ink.width_mm), std::uint8_t{0});
    }
  }
  return dots;
}

double reflectance(const Grey8& dots, const Eigen::Vector2d& mm, double border_mm) {
  const double width_mm = static_cast<double>(dots.width()) / kDotsPerMm,
               height_mm = static_cast<double>(dots.height()) / kDotsPerMm;
  if (mm.x() < -border_mm || mm.y() < -border_mm || mm.x() > width_mm + border_mm || mm.y() > height_mm + border_mm)
    return 0;
  const int x = static_cast<int>(std::floor(mm.x() * kDotsPerMm)),
            y = static_cast<int>(std::floor(mm.y() * kDotsPerMm));
  return dots.view().contains(x, y) && dots.at(x, y) == 0 ? kInk : kPaper;
}

/// The light of a picture times what the board reflects, over each pixel's area. The lens has no distortion.
Grey8 on_board(Grey8 picture, const Lens& camera, const Board& board, const Grey8& dots,
               const RigidTransform& camera_from_board) {
  constexpr int kSamples = 4;
  Eigen::Matrix3d camera_px_from_board;
  camera_px_from_board << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  Eigen::Matrix3d plane;
  plane << camera_from_board.rotation.leftCols<2>(), camera_from_board.translation;
  const Eigen::Matrix3d board_from_camera_px = (camera_px_from_board * plane).inverse();
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      double sum = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const Eigen::Vector3d pixel(x - 0.5 + (i % kSamples + 0.5) / kSamples,
                                    y - 0.5 + (i / kSamples + 0.5) / kSamples, 1);
        sum += reflectance(dots, (board_from_camera_px * pixel).hnormalized(), board.pitch_mm);
      }
      picture.at(x, y) = static_cast<std::uint8_t>(std::lround(picture.at(x, y) * sum / (kSamples * kSamples)));
    }
  }
  return picture;
}

}  // namespace

Calibration small_rig() {
  Calibration rig = paper_rig();
  const auto halve = [](Lens& lens) {
    lens.width_px /= 2, lens.height_px /= 2;
    lens.fx /= 2, lens.fy /= 2;
    lens.cx = (lens.cx + 0.5) / 2 - 0.5, lens.cy = (lens.cy + 0.5) / 2 - 0.5;
  };
  halve(rig.projector);
  halve(rig.cameras[0].lens);
  return rig;
}

RigidTransform simulated_pose(int index) {
  const double direction = 2.4 * index, tilt = index % 3 == 0 ? 0.1 : 0.5;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(direction), std::sin(direction), 0)).toRotationMatrix();
  const Eigen::Vector3d middle(90 * std::cos(1.7 * index), 50 * std::sin(2.9 * index), 1850 + 60 * (index % 5));
  return {turn, middle - turn * Eigen::Vector3d(210, 150, 0)};
}

void write_simulated_pose(const std::filesystem::path& folder, const Calibration& rig, const Board& board,
                          const Pattern& pattern, const RigidTransform& camera_from_board) {
  std::filesystem::create_directories(folder);
  const Surface surface = plane(camera_from_board.translation, camera_from_board.rotation.col(2));
  const Grey8 dots = print(board);
  const Grey8 lit = draw_pattern(pattern);
  const auto write = [&](const char* name, const Grey8& projected) {
    const Grey8 seen =
        simulate(projected, rig, surface, {.dark = 12, .lit = 230, .blur_sigma_px = 0.6, .noise_sigma = 1});
    const auto png = encode_png(on_board(seen, rig.cameras[0].lens, board, dots, camera_from_board));
    if (!png || !write_file_atomically(folder / name, *png)) std::abort();
  };
  write("white.png", Grey8(lit.width(), lit.height(), 255));
  write("pattern.png", lit);
}

}  // namespace slsd
