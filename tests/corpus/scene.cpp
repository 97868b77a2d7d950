// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/scene.hpp"
#include "core/calibration_file/calibration_file.hpp"

#include <filesystem>

#include "drivers/files/read_image.hpp"
#include "tests/corpus/read_with.hpp"

namespace slsd {

namespace {

constexpr double kBaselineMm = 180, kPlaneMm = 2000, kFocalPx = 2500;

const std::filesystem::path& root() {
  static const std::filesystem::path path = SLSD_SOURCE_DIR;
  return path;
}

Calibration calibration_of_pattern(const Pattern& pattern) {
  const int width = pattern.options.projector_width_px, height = pattern.options.projector_height_px;
  Calibration calibration;
  calibration.projector = {width, height, kFocalPx, kFocalPx, 0.5 * (width - 1), 0.5 * (height - 1), {}};
  CalibratedCamera camera;
  camera.name = "camera";
  camera.lens = calibration.projector;
  camera.lens.cx += kFocalPx * kBaselineMm / kPlaneMm;
  camera.projector_from_camera.translation = {kBaselineMm, 0, 0};
  calibration.cameras.push_back(camera);
  return calibration;
}

std::vector<CellTruth> truth_of_pattern(const Pattern& pattern) {
  std::vector<CellTruth> cells;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * (pattern.options.symbol_size_px - 1));
  for (int row = 0; row < pattern.whole_rows(); ++row)
    for (int column = 0; column < pattern.whole_columns(); ++column) {
      const Eigen::Vector2d middle(pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(row));
      cells.push_back({column, row, middle - half, middle + half, SurfaceTruth{middle, kPlaneMm, {0, 0}}, true});
    }
  return cells;
}

}  // namespace

Result<Scene> read_scene(std::string_view folder) {
  const std::filesystem::path path = root() / "tests" / "corpus" / folder;
  auto pattern = read_with(read_pattern, path / "pattern.toml");
  if (!pattern) return tl::unexpected(pattern.error());
  auto calibration = read_with(read_calibration, path / "calibration.yml");
  if (!calibration) return tl::unexpected(calibration.error());
  auto truth = read_with(read_truth, path / "truth.csv");
  if (!truth) return tl::unexpected(truth.error());
  auto frame = read_image(path / "frame.png");
  if (!frame) return tl::unexpected(frame.error());
  return Scene{std::move(*pattern), std::move(*calibration), std::move(*frame), std::move(*truth)};
}

Result<Scene> scene_of_pattern(std::string_view pattern_name) {
  auto pattern = read_with(read_pattern, root() / "config" / "patterns" / (std::string(pattern_name) + ".toml"));
  if (!pattern) return tl::unexpected(pattern.error());
  return Scene{*pattern, calibration_of_pattern(*pattern), draw_pattern(*pattern), truth_of_pattern(*pattern)};
}

}  // namespace slsd
