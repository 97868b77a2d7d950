// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/link_grid.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"

namespace slsd {
namespace {

constexpr int kRows = 24, kColumns = 30;

/// A tilted plane under a camera that is rolled: steps shrink by a third from side to side.
GridMap tilted(float roll_rad) {
  GridMap perspective;
  perspective << 1.3F, 0.1F, 40, 0.05F, 1.25F, 30, 5e-4F, 2e-4F, 1;
  GridMap roll = GridMap::Identity();
  roll.topLeftCorner<2, 2>() = Eigen::Rotation2Df(roll_rad).toRotationMatrix();
  return roll * perspective;
}

/// The frame that a calibration expects: that of the middle of the grid, everywhere.
LatticeFrame expected_frame(const GridMap& map) {
  const Eigen::Vector2f middle = through(map, kRows / 2, kColumns / 2);
  LatticeFrame frame;
  frame.col(0) = (through(map, kRows / 2, kColumns / 2 + 1) - middle) / SimulatedGrid::kPitchPx;
  frame.col(1) = (through(map, kRows / 2 + 1, kColumns / 2) - middle) / SimulatedGrid::kPitchPx;
  return frame;
}

SimulatedGrid grid_of(const GridMap& map, double missing) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<float> noise(0, 0.1F);
  const LatticeFrame frame = expected_frame(map);
  SimulatedGrid grid;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      if (uniform(random) < missing) continue;
      const Eigen::Vector2f centre = through(map, row, column) + Eigen::Vector2f(noise(random), noise(random));
      grid.add(row, column, centre, frame);
    }
  }
  return grid;
}

struct LinkCount {
  int right = 0, wrong = 0, possible = 0, broken = 0;
};

LinkCount count_links(const SimulatedGrid& grid) {
  LinkCount count;
  for (std::size_t i = 0; i < grid.nodes.size(); ++i) {
    for (const Direction d : kDirections) {
      const std::int32_t truth = grid.true_neighbour(i, d), link = grid.nodes[i].links[d];
      count.possible += truth >= 0;
      count.right += truth >= 0 && link == truth;
      count.wrong += link >= 0 && link != truth && !grid.nodes[i].broken[d];
      count.broken += grid.nodes[i].broken[d];
    }
  }
  return count;
}

constexpr float kRolls[] = {0, 0.3F, -1.1F, 3.1F};

TEST(LinkGrid, LinksEveryNodeOfAPerspectiveGrid) {
  for (const float roll : kRolls) {
    SimulatedGrid grid = grid_of(tilted(roll), 0);
    GridLinker({}).link(grid.nodes, alone);
    const LinkCount count = count_links(grid);
    EXPECT_EQ(count.right, count.possible) << roll;
    EXPECT_EQ(count.wrong, 0) << roll;
    EXPECT_EQ(count.broken, 0) << roll;
  }
}

TEST(LinkGrid, LinksAroundMissingNodes) {
  for (const float roll : kRolls) {
    SimulatedGrid grid = grid_of(tilted(roll), 0.2);
    GridLinker({}).link(grid.nodes, alone);
    const LinkCount count = count_links(grid);
    EXPECT_GE(count.right, 0.995 * count.possible) << roll;
    EXPECT_EQ(count.wrong, 0) << roll;
  }
}

TEST(LinkGrid, LinksAreMutual) {
  SimulatedGrid grid = grid_of(tilted(0.3F), 0.3);
  GridLinker({}).link(grid.nodes, alone);
  for (std::size_t i = 0; i < grid.nodes.size(); ++i) {
    for (const Direction d : kDirections) {
      const std::int32_t other = grid.nodes[i].links[d];
      if (other < 0) continue;
      EXPECT_EQ(grid.nodes[other].links[opposite(d)], static_cast<std::int32_t>(i));
    }
  }
}

TEST(LinkGrid, BreaksALinkThatLeadsOntoARidge) {
  for (const float roll : kRolls) {
    const GridMap map = tilted(roll);
    SimulatedGrid grid = grid_of(map, 0);
    // The right half of one row stands out and is seen a quarter of a step farther along.
    const Eigen::Vector2f jump = 0.25F * SimulatedGrid::kPitchPx * expected_frame(map).col(0);
    for (int column = kColumns / 2; column < kColumns; ++column) grid.nodes[grid.node_at(10, column)].centre_px += jump;
    GridLinker({}).link(grid.nodes, alone);
    const GridNode& before = grid.nodes[grid.node_at(10, kColumns / 2 - 1)];
    EXPECT_TRUE(before.links[kRight] < 0 || before.broken[kRight]) << roll;
    EXPECT_EQ(count_links(grid).wrong, 0) << roll;
  }
}

TEST(LinkGrid, BreaksEveryLinkAcrossAStraightEdge) {
  for (const float roll : kRolls) {
    const GridMap map = tilted(roll);
    SimulatedGrid grid = grid_of(map, 0);
    const Eigen::Vector2f jump = 0.25F * SimulatedGrid::kPitchPx * expected_frame(map).col(0);
    for (int row = 0; row < kRows; ++row) {
      for (int column = kColumns / 2; column < kColumns; ++column)
        grid.nodes[grid.node_at(row, column)].centre_px += jump;
    }
    GridLinker({}).link(grid.nodes, alone);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column + 1 < kColumns; ++column) {
        const GridNode& node = grid.nodes[grid.node_at(row, column)];
        const bool linked = node.links[kRight] >= 0 && !node.broken[kRight];
        EXPECT_EQ(linked, column + 1 != kColumns / 2) << roll << ' ' << row << ' ' << column;
      }
    }
  }
}

TEST(LinkGrid, KeepsALinkBetweenTornSymbols) {
  for (const bool told : {false, true}) {
    const GridMap map = tilted(0);
    SimulatedGrid grid = grid_of(map, 0);
    // Those before and behind two whole ones have lost a part each.
    const Eigen::Vector2f moved = 0.25F * SimulatedGrid::kPitchPx * expected_frame(map).col(0);
    const int left = kColumns / 2;
    for (const int column : {left - 1, left + 2}) {
      GridNode& node = grid.nodes[grid.node_at(10, column)];
      node.centre_px += moved;
      node.split = told;
    }
    GridLinker({}).link(grid.nodes, alone);
    const GridNode& node = grid.nodes[grid.node_at(10, left)];
    EXPECT_EQ(node.links[kRight] >= 0 && !node.broken[kRight], told);
    EXPECT_TRUE(node.links[kLeft] < 0 || node.broken[kLeft]);
  }
}

TEST(LinkGrid, MeasuresTheFramesOfATiltedPlane) {
  const GridMap map = tilted(0.3F);
  SimulatedGrid grid = grid_of(map, 0);
  GridLinker({}).link(grid.nodes, alone);
  double expected_error = 0, measured_error = 0;
  for (std::size_t i = 0; i < grid.nodes.size(); ++i) {
    const auto [row, column] = grid.cells[i];
    LatticeFrame truth;
    truth.col(0) = (through(map, row, column + 1) - through(map, row, column - 1)) / (2 * SimulatedGrid::kPitchPx);
    truth.col(1) = (through(map, row + 1, column) - through(map, row - 1, column)) / (2 * SimulatedGrid::kPitchPx);
    EXPECT_TRUE(grid.nodes[i].measured_u && grid.nodes[i].measured_v);
    measured_error = std::max<double>(measured_error, (grid.nodes[i].frame - truth).norm());
    expected_error = std::max<double>(expected_error, (expected_frame(map) - truth).norm());
  }
  EXPECT_GT(expected_error, 0.3);
  EXPECT_LT(measured_error, 0.07);
}

TEST(MeasureFrame, LeavesNodesOutThatAreNotTrusted) {
  const GridMap map = GridMap::Identity();
  SimulatedGrid grid = grid_of(map, 0);
  GridLinker linker({});
  linker.link(grid.nodes, alone);
  const std::int32_t fragment = grid.node_at(10, 10), beside = grid.node_at(10, 9);
  grid.nodes[fragment].centre_px.x() -= 4;
  std::vector<std::uint8_t> trusted(grid.nodes.size(), 1);
  linker.measure_frame(grid.nodes, trusted, static_cast<std::size_t>(beside));
  EXPECT_LT(grid.nodes[beside].frame(0, 0), 0.93F);
  trusted[fragment] = 0;
  linker.measure_frame(grid.nodes, trusted, static_cast<std::size_t>(beside));
  EXPECT_NEAR(grid.nodes[beside].frame(0, 0), 1, 0.03);
}

TEST(LinkGrid, OfNoneOneAndTwoNodes) {
  GridLinker linker({});
  std::vector<GridNode> nodes;
  linker.link(nodes, alone);
  nodes.push_back({{100, 100}, LatticeFrame::Identity()});
  linker.link(nodes, alone);
  EXPECT_THAT(nodes[0].links, testing::Each(-1));
  nodes.push_back({{118, 101}, LatticeFrame::Identity()});
  linker.link(nodes, alone);
  EXPECT_THAT(nodes[0].links, testing::ElementsAre(1, -1, -1, -1));
  EXPECT_THAT(nodes[1].links, testing::ElementsAre(-1, -1, 0, -1));
}

TEST(LinkGrid, OfNodesAtOnePlace) {
  std::vector<GridNode> nodes(50, GridNode{{5, 5}, LatticeFrame::Identity()});
  GridLinker({}).link(nodes, alone);
  for (const GridNode& node : nodes) EXPECT_THAT(node.links, testing::Each(-1));
}

TEST(Opposite, UndoesAStep) {
  for (const Direction d : kDirections) EXPECT_EQ(step(opposite(d)), -step(d));
}

}  // namespace
}  // namespace slsd
