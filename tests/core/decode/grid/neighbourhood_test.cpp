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

std::vector<std::int32_t> nodes_of(const std::vector<LinkWalk::Stop>& stops) {
  std::vector<std::int32_t> nodes;
  for (const LinkWalk::Stop& stop : stops) nodes.push_back(stop.node);
  return nodes;
}

TEST(LinkWalk, ReachesEachOnceAndTheNearestFirst) {
  const SimulatedGrid grid = nine();
  LinkWalk walk;
  const auto reached = [&](std::int32_t from, int reach) {
    return nodes_of(walk.walk(grid.nodes, from, reach, [](auto&&...) { return LinkWalk::Go::kOn; }));
  };
  EXPECT_THAT(reached(0, 0), testing::ElementsAre(0));
  EXPECT_THAT(reached(0, 1), testing::ElementsAre(0, 1, 3));
  EXPECT_THAT(reached(0, 2), testing::ElementsAre(0, 1, 3, 2, 4, 6));
  EXPECT_THAT(reached(4, 9), testing::UnorderedElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(LinkWalk, CountsRowsAndColumnsFromTheFirst) {
  const SimulatedGrid grid = nine();
  LinkWalk walk;
  for (const auto& [node, rows, columns] : walk.walk(grid.nodes, 4, 9, [](auto&&...) { return LinkWalk::Go::kOn; })) {
    EXPECT_EQ(rows, node / 3 - 1);
    EXPECT_EQ(columns, node % 3 - 1);
  }
}

TEST(LinkWalk, LeavesOutWhatItGoesPast) {
  const SimulatedGrid grid = nine();
  LinkWalk walk;
  const auto past_the_middle = [](const LinkWalk::Stop&, const LinkWalk::Stop& to, Direction) {
    return to.node % 3 == 1 ? LinkWalk::Go::kPast : LinkWalk::Go::kOn;
  };
  EXPECT_THAT(nodes_of(walk.walk(grid.nodes, 0, 9, past_the_middle)), testing::ElementsAre(0, 3, 6));
}

TEST(LinkWalk, EndsWhereItIsTold) {
  const SimulatedGrid grid = nine();
  LinkWalk walk;
  const auto up_to_four = [](const LinkWalk::Stop&, const LinkWalk::Stop& to, Direction) {
    return to.node == 4 ? LinkWalk::Go::kNoFarther : LinkWalk::Go::kOn;
  };
  EXPECT_THAT(nodes_of(walk.walk(grid.nodes, 0, 9, up_to_four)), testing::ElementsAre(0, 1, 3, 2));
  EXPECT_THAT(nodes_of(walk.walk(grid.nodes, 8, 9, up_to_four)), testing::ElementsAre(8, 7, 5, 6))
      << "nothing is left over";
}

TEST(LinkWalk, DoesNotFollowBrokenLinks) {
  SimulatedGrid grid = nine();
  for (const std::int32_t node : {0, 3, 6}) grid.nodes[node].broken[kRight] = true;
  LinkWalk walk;
  EXPECT_THAT(nodes_of(walk.walk(grid.nodes, 0, 9, [](auto&&...) { return LinkWalk::Go::kOn; })),
              testing::ElementsAre(0, 3, 6));
}

}  // namespace
}  // namespace slsd
