// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/surface_links.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

/// A plane of the grid, all of whose symbols are whole and as bright as each other.
struct Plane {
  static constexpr int kSide = 9;
  Pattern pattern = shipped_pattern("16px-5.toml");
  CellRays cells{pattern, flat_prototypes(), paper_rig().projector};
  LetterEvidence letters{pattern.array, {kWholeRows, kWholeColumns}};
  SimulatedGrid grid;
  std::vector<Classification> shapes;
  std::vector<GreyMoments> moments;
  std::vector<Aligned> aligned;
  std::vector<std::int32_t> labels;
  std::vector<Beside> beside;
  SurfaceLinks links{SimulatedGrid::kPitchPx};

  Plane() {
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        grid.add(row, column, {18.F * static_cast<float>(column), 18.F * static_cast<float>(row)},
                 LatticeFrame::Identity());
        shapes.push_back(read_as(pattern.array.at(row, column), 5, 0.99));
        GreyMoments light;
        light.background = 20, light.peak = 180 + static_cast<float>((row * 7 + column * 5) % 11);
        moments.push_back(light);
        labels.push_back(row * kWholeColumns + column);
      }
    }
    grid.link_truly();
  }
  void measure() {
    aligned.assign(grid.nodes.size(), Aligned::kNot);
    find_beside(grid.nodes, beside);
    letters.look_at(shapes, aligned);
    SerialExecutor alone;
    links.measure({grid.nodes, beside, moments, aligned, labels}, letters, CellGate(cells, {}, 1.5), alone);
  }
  /// Moves all symbols from a column on, cells.
  void slide_from(int column, float by) {
    for (std::size_t i = 0; i < grid.nodes.size(); ++i)
      if (grid.cells[i].second >= column) grid.nodes[i].centre_px.x() += by * SimulatedGrid::kPitchPx;
  }
  [[nodiscard]] float nats(int row, int column, Direction d) const {
    return links.of(static_cast<std::size_t>(grid.node_at(row, column)))[d];
  }
};

TEST(SurfaceLinks, SpeakForOneSurfaceOnAPlane) {
  Plane plane;
  plane.measure();
  for (int row = 1; row < Plane::kSide - 1; ++row)
    for (int column = 1; column < Plane::kSide - 1; ++column)
      for (const Direction d : kDirections) EXPECT_GT(plane.nats(row, column, d), 1) << row << ", " << column;
}

TEST(SurfaceLinks, SpeakAgainstOneSurfaceAcrossAStep) {
  Plane plane;
  plane.slide_from(5, 0.12F);
  plane.measure();
  for (int row = 0; row < Plane::kSide; ++row) {
    EXPECT_LT(plane.nats(row, 4, kRight), -1) << row;
    EXPECT_EQ(plane.nats(row, 4, kRight), plane.nats(row, 5, kLeft));
    EXPECT_GT(plane.nats(row, 2, kRight), 1) << row;
  }
}

TEST(SurfaceLinks, SpeakAgainstASymbolThatIsDarkerThanThoseBesideIt) {
  Plane bright, dark;
  dark.moments[static_cast<std::size_t>(dark.grid.node_at(4, 4))].peak = 90;
  bright.measure(), dark.measure();
  for (const Direction d : kDirections) EXPECT_LT(dark.nats(4, 4, d), bright.nats(4, 4, d) - 1);
  EXPECT_NEAR(dark.nats(7, 7, kUp), bright.nats(7, 7, kUp), 0.3F);
}

TEST(SurfaceLinks, KnowNothingOfTornSymbols) {
  Plane plane;
  plane.grid.nodes[static_cast<std::size_t>(plane.grid.node_at(4, 4))].split = true;
  plane.shapes[static_cast<std::size_t>(plane.grid.node_at(4, 4))].distance = 20;
  plane.measure();
  for (const Direction d : kDirections) EXPECT_EQ(plane.nats(4, 4, d), 0);
}

}  // namespace
}  // namespace slsd
