// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/appearance/align_patches.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/pixel_ray.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr int kColumns = 13, kX = 700, kY = 500;
constexpr float kBlockNoise = 2, kBlockGain = 170, kBlockGainX = 0.3F, kBlockGainY = -0.2F, kBlockOffset = 25;

Grey8 pattern_image() {
  return draw_pattern(make_pattern({.symbols = {11, 13, 14, 18, 19}, .method = ArrayMethod::kConstructive}).value());
}

/// A plane that the paper's rig sees, and blocks on it.
class BlockScene {
 public:
  explicit BlockScene(float blur_px = 0.72F) : field_(pattern_image().view(), blur_px) {}

  [[nodiscard]] double inverse_depth(double x, double y) const {
    const Eigen::Vector3d ray = rig_.cameras[0].lens.undistort({x, y}).homogeneous();
    return 1 / *surface_({Eigen::Vector3d::Zero(), ray});
  }
  /// The plane and the light there, as a start that is off by so many projector px.
  [[nodiscard]] PatchTask task(int x, int y, float off_px) const {
    const CalibratedCamera& camera = rig_.cameras[0];
    PatchTask task;
    task.x = x, task.y = y, task.noise = kBlockNoise;
    task.map = make_patch_map(pixel_ray(camera.lens, {x, y}), {x, y}, camera.projector_from_camera, rig_.projector,
                              1 / inverse_depth(x, y));
    const double per_px = task.map.inverse_depth_per_px;
    task.state.disparity = off_px;
    task.state.slope_x = static_cast<float>((inverse_depth(x + 1, y) - inverse_depth(x - 1, y)) / 2 / per_px);
    task.state.slope_y = static_cast<float>((inverse_depth(x, y + 1) - inverse_depth(x, y - 1)) / 2 / per_px);
    task.state.gain = kBlockGain + kBlockGainX * static_cast<float>(x - kX) + kBlockGainY * static_cast<float>(y - kY);
    task.state.gain_x = kBlockGainX, task.state.gain_y = kBlockGainY, task.state.offset = kBlockOffset;
    return task;
  }
  /// Fits a row of nodes whose blocks start so many projector px off.
  template <class Off>
  std::vector<PatchTask> fit(const BlockSizes& sizes, const Off& off_px, int unknown_column = -1) const {
    const int reach = sizes.reach();
    std::vector<BlockRow> rows(2 * reach + 1);
    std::vector<const BlockRow*> all;
    const std::vector<char> wanted(block_groups(kColumns), 1);
    for (int row = -reach; row <= reach; ++row) {
      BlockRow& blocks = rows[row + reach];
      blocks.resize(kColumns, sizes);
      std::vector<Eigen::Matrix3f> turned;
      for (int column = 0; column < kColumns; ++column) {
        const int x = kX + column * sizes.block_px, y = kY + row * sizes.block_px;
        const PatchTask start = task(x, y, off_px(column, row));
        const auto per_px = static_cast<float>(start.map.inverse_depth_per_px);
        turned.push_back(
            turned_by(pixel_ray(rig_.cameras[0].lens, {x, y}), rig_.cameras[0].projector_from_camera).cast<float>());
        const auto set = [&](BlockRow::Number number, float value) { blocks.of(number)[column] = value; };
        set(BlockRow::kKnown, column == unknown_column ? 0.F : 1.F);
        set(BlockRow::kInverseDepth, static_cast<float>(inverse_depth(x, y)) + start.state.disparity * per_px);
        set(BlockRow::kPlaneX, start.state.slope_x * per_px), set(BlockRow::kPlaneY, start.state.slope_y * per_px);
        set(BlockRow::kGain, start.state.gain), set(BlockRow::kGainX, kBlockGainX), set(BlockRow::kGainY, kBlockGainY);
        set(BlockRow::kOffset, kBlockOffset), set(BlockRow::kNoise, kBlockNoise);
      }
      const Eigen::Vector3d& translation = rig_.cameras[0].projector_from_camera.translation;
      sum_blocks(frame_.view(), 255, field_, options(), sizes,
                 {kX,
                  kY + row * sizes.block_px,
                  turned[0].data(),
                  {translation.x(), translation.y(), translation.z()},
                  rig_.projector,
                  {}},
                 wanted, blocks);
      all.push_back(&blocks);
    }
    BlockFitter fitter(sizes);
    fitter.add_columns(all, wanted);
    std::vector<PatchTask> tasks(kColumns);
    for (int group = 0; group < block_groups(kColumns); ++group) {
      std::array<PatchTask, kEight> eight;
      fitter.fit_group(options(), group, eight);
      for (int lane = 0; lane < kEight; ++lane) tasks[first_of_group(group, kColumns) + lane] = eight[lane];
    }
    return tasks;
  }
  [[nodiscard]] PatchTask alone(int x, int y, float off_px, int window_px) const {
    PatchTask alone = task(x, y, off_px);
    PatchTask* const one = &alone;
    align_eight(frame_.view(), 255, field_, options(), window_px, std::span(&one, 1));
    return alone;
  }
  static AlignOptions options() {
    AlignOptions options;
    options.gain_slope_sigma = 0.02F;
    return options;
  }

 private:
  Calibration rig_ = paper_rig();
  Surface surface_ = plane({0, 0, 2000}, {0.3, 0.15, -1});
  Grey8 frame_ = simulate(pattern_image(), rig_, surface_, {});
  PatternField field_;
};

double inverse_depth_of(const PatchTask& task) {
  return task.map.reference_inverse_depth + static_cast<double>(task.state.disparity) * task.map.inverse_depth_per_px;
}

TEST(AlignBlocks, WindowsHaveAlmostTheSideAskedFor) {
  for (int block = 1; block <= 16; ++block) {
    for (int window = 11; window <= 21; ++window) {
      const BlockSizes sizes = block_sizes(block, window);
      if (sizes.window_pieces == 0) continue;
      EXPECT_NEAR(sizes.window_px(), window, 1) << block;
      EXPECT_EQ(block % sizes.pieces, 0) << window;
      EXPECT_EQ(sizes.window_pieces % 2, sizes.pieces % 2) << block << ' ' << window;
      EXPECT_GE((2 * sizes.reach() + 1) * sizes.pieces, sizes.window_pieces);
    }
  }
  EXPECT_EQ(block_sizes(4, 11).window_px(), 12);
  EXPECT_EQ(block_sizes(4, 17).window_px(), 16);
  EXPECT_EQ(block_sizes(4, 19).window_px(), 20);
}

TEST(AlignBlocks, BlocksOnOnePlaneGiveTheStepOfTheirWindow) {
  const BlockScene scene;
  const BlockSizes sizes{5, 1, 3};
  const std::vector<PatchTask> fitted = scene.fit(sizes, [](int, int) { return 0.05F; });
  for (int column = 1; column + 1 < kColumns; ++column) {
    const PatchTask& got = fitted[column];
    const PatchTask alone = scene.alone(kX + 5 * column, kY, 0.05F, 15);
    ASSERT_FALSE(got.failed || alone.failed) << column;
    const double per_px = alone.map.inverse_depth_per_px;
    EXPECT_NEAR((inverse_depth_of(got) - inverse_depth_of(alone)) / per_px, 0, 1e-3) << column;
    EXPECT_NEAR(got.state.slope_x, alone.state.slope_x, 3e-4);
    EXPECT_NEAR(got.state.slope_y, alone.state.slope_y, 3e-4);
    EXPECT_NEAR(got.state.across, alone.state.across, 1e-3);
    EXPECT_NEAR(got.state.gain, alone.state.gain, 0.2);
    EXPECT_NEAR(got.state.offset, alone.state.offset, 0.1);
    EXPECT_NEAR(got.residual, alone.residual, 0.02 * static_cast<double>(alone.residual));
    EXPECT_NEAR(got.support, alone.support, 0.01);
    EXPECT_NEAR(got.variance, alone.variance, 0.01 * static_cast<double>(alone.variance));
    EXPECT_NEAR(got.slope_variance, alone.slope_variance, 0.01 * static_cast<double>(alone.slope_variance));
    EXPECT_NEAR(got.scatter, alone.scatter, 0.01);
    EXPECT_EQ(got.pixels, alone.pixels);
  }
  // Nodes at the row's ends miss a block.
  EXPECT_TRUE(fitted.front().failed && fitted.back().failed);
}

TEST(AlignBlocks, StartsOfBlocksMayDiffer) {
  const BlockScene scene;
  // Unreferred, these starts would move each node by two thirds of the step.
  constexpr float kStepPx = 0.03F;
  const auto of_rows = [](int, int row) { return row == 0 ? 0 : kStepPx; };
  const auto of_columns = [](int column, int) { return column % 2 == 0 ? 0 : kStepPx; };
  const auto expect_alone = [&](const auto& off) {
    const std::vector<PatchTask> fitted = scene.fit({5, 1, 3}, off);
    double squares = 0;
    for (int column = 1; column + 1 < kColumns; ++column) {
      const PatchTask alone = scene.alone(kX + 5 * column, kY, off(column, 0), 15);
      ASSERT_FALSE(fitted[column].failed || alone.failed) << column;
      const double apart =
          (inverse_depth_of(fitted[column]) - inverse_depth_of(alone)) / alone.map.inverse_depth_per_px;
      squares += apart * apart;
      EXPECT_NEAR(fitted[column].state.slope_x, alone.state.slope_x, 3e-3);
      EXPECT_NEAR(fitted[column].state.slope_y, alone.state.slope_y, 3e-3);
      EXPECT_NEAR(fitted[column].residual, alone.residual, 0.06 * static_cast<double>(alone.residual));
    }
    EXPECT_LT(std::sqrt(squares / (kColumns - 2)), 0.25 * static_cast<double>(kStepPx));
  };
  expect_alone(of_rows), expect_alone(of_columns);
}

TEST(AlignBlocks, PiecesChangeNothing) {
  const BlockScene scene;
  const auto off = [](int column, int row) { return 0.01F * static_cast<float>((column + 2 * row + 10) % 5 - 2); };
  const std::vector<PatchTask> whole = scene.fit({4, 1, 3}, off), pieces = scene.fit({4, 2, 6}, off);
  for (int column = 1; column + 1 < kColumns; ++column) {
    ASSERT_FALSE(whole[column].failed || pieces[column].failed);
    EXPECT_NEAR(whole[column].state.disparity, pieces[column].state.disparity, 1e-4);
    EXPECT_NEAR(whole[column].residual, pieces[column].residual, 1e-2);
    EXPECT_NEAR(whole[column].scatter, pieces[column].scatter, 1e-3);
  }
}

TEST(AlignBlocks, ABlockWithoutAStartLeavesItsWindowsUnfitted) {
  const BlockScene scene;
  const std::vector<PatchTask> fitted = scene.fit(
      {4, 1, 3}, [](int, int) { return 0.F; }, 6);
  for (int column = 1; column + 1 < kColumns; ++column)
    EXPECT_EQ(fitted[column].failed, column >= 5 && column <= 7) << column;
}

}  // namespace
}  // namespace slsd
