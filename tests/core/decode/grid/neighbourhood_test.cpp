// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/neighbourhood.hpp"

#include <gmock/gmock.h>

#include "tests/core/decode/grid/simulated_grid.hpp"

namespace slsd {
namespace {

/// Nine nodes, 0 to 8 row by row, all linked.
SimulatedGrid nine() {
  SimulatedGrid grid;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) grid.add(row, column, {0, 0}, LatticeFrame::Identity());
  }
  grid.link_truly();
  return grid;
}

Neighbourhood around(const SimulatedGrid& grid, std::int32_t node) {
  std::vector<Beside> beside;
  find_beside(grid.nodes, beside);
  return neighbourhood(beside, node);
}

void unlink(std::vector<GridNode>& nodes, std::int32_t node, Direction direction) {
  nodes[nodes[node].links[direction]].links[opposite(direction)] = -1;
  nodes[node].links[direction] = -1;
}

TEST(Neighbourhood, IsTheWindowRowByRow) {
  EXPECT_THAT(around(nine(), 4), testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(Neighbourhood, LeavesOutWhatIsBeyondTheGrid) {
  EXPECT_THAT(around(nine(), 0), testing::ElementsAre(-1, -1, -1, -1, 0, 1, -1, 3, 4));
}

TEST(Neighbourhood, ReachesACornerByTheOtherWay) {
  SimulatedGrid grid = nine();
  unlink(grid.nodes, 1, kRight);
  EXPECT_EQ(around(grid, 4)[2], 2);
  unlink(grid.nodes, 5, kUp);
  EXPECT_EQ(around(grid, 4)[2], -1);
}

TEST(Neighbourhood, LeavesOutACornerThatTwoWaysDisagreeAbout) {
  SimulatedGrid grid = nine();
  grid.nodes[1].links[kRight] = 8;
  EXPECT_EQ(around(grid, 4)[2], -1);
}

TEST(Neighbourhood, DoesNotFollowBrokenLinks) {
  SimulatedGrid grid = nine();
  grid.nodes[4].broken[kRight] = true;
  grid.nodes[1].broken[kRight] = true;
  EXPECT_THAT(around(grid, 4), testing::ElementsAre(0, 1, -1, 3, 4, -1, 6, 7, 8));
}

}  // namespace
}  // namespace slsd
