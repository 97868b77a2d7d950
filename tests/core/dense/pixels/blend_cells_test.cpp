// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/blend_cells.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

Calibration eighth_rig() {
  Calibration rig = paper_rig();
  Lens& lens = rig.cameras[0].lens;
  lens.width_px = 203, lens.height_px = 150;
  for (double* value : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *value /= 8;
  return rig;
}

/// A smooth surface at about 1000 mm with some nodes missing, some far off, and some that doubt.
void draw_nodes(SurfaceGrid& grid, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(0, 1);
  grid.clear();
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      SurfaceNode& node = grid.nodes()[static_cast<std::size_t>(row) * grid.columns() + column];
      const auto x = static_cast<float>(grid.x_of(column)), y = static_cast<float>(grid.y_of(row));
      node.plane = {1e-3F + 1e-7F * x - 2e-7F * y + 1e-10F * x * x, 1e-7F + 2e-10F * x, -2e-7F};
      node.per_px = 1e-6F, node.noise_px = 0.01F + 0.01F * any(random), node.sigma_px = 0.02F + 0.01F * any(random);
      node.gain = 100 + 50 * any(random), node.offset = 10;
      node.support = any(random) < 0.1F ? 0.7F : 0.95F;
      node.good = any(random) > 0.1F;
      if (any(random) < 0.05F) node.plane.inverse_depth *= 1.01F;
    }
  }
}

/// The kind of a cell, and the blend of its corners at a pixel, one after the other.
struct PlainCell {
  CellKind kind = CellKind::kApart;
  double depth_mm = 0, sigma_mm = 0, light = 0;
};
PlainCell plain_cell(const SurfaceGrid& grid, int column, int row, int x, int y) {
  PlainCell cell;
  const double stride = grid.stride_px(), middle = 0.5 * (stride - 1);
  double least = 1, most = 0, noise = 0, support = 1, value = 0, sigma = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner % 2, down = corner / 2;
    const SurfaceNode* node = grid.good(column + right, row + down);
    if (node == nullptr) return cell;
    const auto at = [&](double dx, double dy, double of_slopes) {
      return static_cast<double>(node->plane.inverse_depth) +
             of_slopes * ((dx - right * stride) * static_cast<double>(node->plane.slope_x) +
                          (dy - down * stride) * static_cast<double>(node->plane.slope_y));
    };
    least = std::min(least, at(middle, middle, 1)), most = std::max(most, at(middle, middle, 1));
    noise = std::max(noise, static_cast<double>(node->noise_px));
    support = std::min(support, static_cast<double>(node->support));
    const double share = (right != 0 ? x / stride : 1 - x / stride) * (down != 0 ? y / stride : 1 - y / stride);
    value += share * at(x, y, 0.5), sigma += share * static_cast<double>(node->sigma_px);
    cell.light += share * static_cast<double>(node->gain + node->offset);
  }
  const double per_px = static_cast<double>(grid.good(column, row)->per_px);
  if (!(most - least < per_px * (0.12 + 4 * noise))) return cell;
  cell.kind = support >= 0.85 ? CellKind::kClean : CellKind::kDoubtful;
  cell.depth_mm = 1 / value, cell.sigma_mm = per_px * cell.depth_mm * cell.depth_mm * sigma;
  return cell;
}

class BlendCells : public testing::TestWithParam<int> {};

TEST_P(BlendCells, EqualsTheBlendOfSinglePixels) {
  const Calibration rig = eighth_rig();
  const PatchGeometry geometry(rig.cameras[0], rig.projector);
  SurfaceGrid grid(geometry, {GetParam(), 11, 400, 2500});
  CellBlender blender(grid, 400, 2500);
  DenseMap map;
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    draw_nodes(grid, seed);
    map.reset(rig.cameras[0].lens.width_px, rig.cameras[0].lens.height_px);
    std::fill(map.depth_mm.begin(), map.depth_mm.end(), 7.F);  // rubbish to be cleared
    blender.begin(255);
    std::size_t blended = 0, apart = 0;
    for (int row = -1; row < grid.rows(); ++row) {
      const auto kinds = blender.blend_row(grid, row, map);
      for (int y = std::max(0, grid.y_of(row)); y < std::min(map.height, grid.y_of(row + 1)); ++y) {
        for (int x = 0; x < map.width; ++x) {
          const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
          const int column = x < grid.x_of(0) ? -1 : (x - grid.x_of(0)) / grid.stride_px();
          const PlainCell cell = plain_cell(grid, column, row, x - grid.x_of(column), y - grid.y_of(row));
          if (column >= 0 && column + 1 < grid.columns()) {
            ASSERT_EQ(kinds[column], cell.kind) << column << ' ' << row;
          }
          if (cell.kind == CellKind::kApart) {
            ++apart;
            ASSERT_EQ(map.pixels[pixel], DensePixel::kNotReached);
            ASSERT_TRUE(std::isnan(map.depth_mm[pixel]));
            continue;
          }
          ++blended;
          ASSERT_EQ(map.pixels[pixel], DensePixel::kMeasured);
          ASSERT_NEAR(map.depth_mm[pixel], cell.depth_mm, 1e-6 * cell.depth_mm);
          ASSERT_NEAR(map.sigma_mm[pixel], cell.sigma_mm, 1e-4 * cell.sigma_mm);
          ASSERT_NEAR(map.intensity[pixel], std::clamp(cell.light, 1.0, 255.0), 1.001);
        }
      }
    }
    EXPECT_GT(blended, 5000U);
    EXPECT_GT(apart, 1000U);
  }
}

TEST_P(BlendCells, DropsPixelsOutsideTheRangeOfDepths) {
  const Calibration rig = eighth_rig();
  const PatchGeometry geometry(rig.cameras[0], rig.projector);
  SurfaceGrid grid(geometry, {GetParam(), 11, 400, 2500});
  CellBlender blender(grid, 400, 995);
  DenseMap map;
  map.reset(rig.cameras[0].lens.width_px, rig.cameras[0].lens.height_px);
  draw_nodes(grid, 4);
  blender.begin(255);
  for (int row = -1; row < grid.rows(); ++row) (void)blender.blend_row(grid, row, map);
  map.count_pixels();
  EXPECT_GT(map.count(DensePixel::kMeasured), 1000U);
  EXPECT_GT(map.count(DensePixel::kOutOfDepthRange), 1000U);
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (map.measured(i)) {
      ASSERT_LE(map.depth_mm[i], 995);
    } else {
      ASSERT_TRUE(std::isnan(map.depth_mm[i]));
    }
  }
}

TEST_P(BlendCells, ContinuesASurfaceOfTheSecondOrderExactly) {
  const Calibration rig = eighth_rig();
  const PatchGeometry geometry(rig.cameras[0], rig.projector);
  SurfaceGrid grid(geometry, {GetParam(), 11, 400, 2500});
  CellBlender blender(grid, 400, 2500);
  const auto inverse_depth = [](double x, double y) {
    return 1e-3 - 1e-10 * (x - 100) * (x - 100) - 2e-10 * (y - 75) * (y - 75) + 1.5e-10 * (x - 100) * (y - 75);
  };
  draw_nodes(grid, 5);
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const double x = grid.x_of(column), y = grid.y_of(row);
      grid.nodes()[static_cast<std::size_t>(row) * grid.columns() + column].plane = {
          static_cast<float>(inverse_depth(x, y)), static_cast<float>(-2e-10 * (x - 100) + 1.5e-10 * (y - 75)),
          static_cast<float>(-4e-10 * (y - 75) + 1.5e-10 * (x - 100))};
    }
  }
  DenseMap map;
  map.reset(rig.cameras[0].lens.width_px, rig.cameras[0].lens.height_px);
  blender.begin(255);
  for (int row = -1; row < grid.rows(); ++row) (void)blender.blend_row(grid, row, map);
  std::size_t blended = 0;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (!map.measured(i)) continue;
    ++blended;
    const auto x = static_cast<double>(i % map.width), y = static_cast<double>(i / map.width);
    ASSERT_NEAR(map.depth_mm[i] * inverse_depth(x, y), 1, 4e-7) << x << ' ' << y;  // the rounding of floats
  }
  EXPECT_GT(blended, 5000U);
}

INSTANTIATE_TEST_SUITE_P(Strides, BlendCells, testing::Values(1, 3, 4, 8, 11));

}  // namespace
}  // namespace slsd
