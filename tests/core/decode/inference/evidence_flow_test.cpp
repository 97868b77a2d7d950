// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/evidence_flow.hpp"

#include <algorithm>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace slsd {
namespace {

/// Nodes in rows and columns, each linked with the four beside it.
struct Network {
  int rows, columns;
  std::vector<Beside> beside;
  std::vector<float> supply;
  std::vector<std::array<float, 4>> capacity;

  Network(int of_rows, int of_columns) : rows(of_rows), columns(of_columns) {
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const auto at = [&](int r, int c) {
          return r < 0 || c < 0 || r >= rows || c >= columns ? -1 : r * columns + c;
        };
        beside.push_back({at(row, column + 1), at(row + 1, column), at(row, column - 1), at(row - 1, column)});
      }
    }
    supply.assign(beside.size(), 0);
    capacity.assign(beside.size(), {});
  }
  [[nodiscard]] EvidenceFlow flow() const {
    EvidenceFlow flow;
    flow.clear(beside);
    for (std::size_t i = 0; i < beside.size(); ++i) {
      flow.set_supply(i, supply[i]);
      for (const Direction d : kDirections)
        if (beside[i][d] >= 0) flow.set_capacity(i, d, capacity[i][d]);
    }
    return flow;
  }
  /// The least that parts a node from evidence: over every set of nodes with it, the supplies in the set and the
  /// capacities of the links out of it. By Ford and Fulkerson the most that can flow to the node.
  [[nodiscard]] float least_cut(int node) const {
    float least = 1e9F;
    for (unsigned set = 0; set < 1U << beside.size(); ++set) {
      if ((set >> node & 1U) == 0) continue;
      float cut = 0;
      for (std::size_t i = 0; i < beside.size(); ++i) {
        if ((set >> i & 1U) == 0) continue;
        cut += supply[i];
        for (const Direction d : kDirections)
          if (beside[i][d] >= 0 && (set >> beside[i][d] & 1U) == 0) cut += capacity[i][d];
      }
      least = std::min(least, cut);
    }
    return least;
  }
};

TEST(EvidenceFlow, IsTheLeastCut) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> nats(0, 5);
  for (int trial = 0; trial < 200; ++trial) {
    Network network(2 + trial % 2, 4);
    for (float& supply : network.supply) supply = random() % 3 == 0 ? 0 : nats(random);
    for (auto& of_node : network.capacity)
      for (float& capacity : of_node) capacity = random() % 4 == 0 ? 0 : nats(random);
    const auto node = static_cast<std::int32_t>(random() % network.beside.size());
    EXPECT_NEAR(network.flow().draw(node, 1000), network.least_cut(node), 1e-2F) << trial;
  }
}

TEST(EvidenceFlow, DrawsNoMoreThanIsWanted) {
  Network network(1, 3);
  network.supply = {2, 3, 4};
  for (auto& of_node : network.capacity) of_node = {9, 9, 9, 9};
  EvidenceFlow flow = network.flow();
  EXPECT_FLOAT_EQ(flow.draw(0, 6), 6);
  EXPECT_FLOAT_EQ(flow.draw(2, 100), 3);
}

TEST(EvidenceFlow, GivesBackWhatWasDrawnSinceItWasKept) {
  Network network(2, 3);
  network.supply = {1, 1, 1, 1, 1, 1};
  for (auto& of_node : network.capacity) of_node = {2, 2, 2, 2};
  EvidenceFlow flow = network.flow();
  EXPECT_FLOAT_EQ(flow.draw(0, 2), 2);
  flow.keep();
  EXPECT_FLOAT_EQ(flow.draw(5, 100), 4);
  EXPECT_FLOAT_EQ(flow.draw(4, 100), 0);
  flow.restore();
  EXPECT_FLOAT_EQ(flow.draw(4, 100), 4);
}

// One straight edge cuts all of a row's links in one event.
TEST(EvidenceFlow, SharesTheCapacityOfALine) {
  Network network(2, 4);
  for (int column = 0; column < 4; ++column) {
    network.supply[4 + column] = 5;
    network.capacity[column] = {9, 3, 9, 0};
    network.capacity[4 + column] = {9, 0, 9, 3};
  }
  EvidenceFlow apart = network.flow(), joined = network.flow();
  const std::int32_t line = joined.add_line(4);
  for (std::size_t column = 0; column < 4; ++column)
    joined.put_on_line(column, kDown, line), joined.put_on_line(4 + column, kUp, line);
  EXPECT_FLOAT_EQ(apart.draw(0, 100), 12);
  EXPECT_FLOAT_EQ(joined.draw(0, 100), 4);
}

TEST(EvidenceFlow, KeepsToTheBudgetOfSides) {
  Network network(1, 5);
  network.supply = {4, 4, 1, 4, 4};
  for (auto& of_node : network.capacity) of_node = {9, 9, 9, 9};
  EXPECT_FLOAT_EQ(network.flow().draw(2, 100), 17);
  EXPECT_FLOAT_EQ(network.flow().draw(2, 100, {.all = 6, .row = 100, .column = 100}), 7);
  EXPECT_FLOAT_EQ(network.flow().draw(2, 100, {.all = 100, .row = 5, .column = 100}), 6);
  EXPECT_FLOAT_EQ(network.flow().draw(2, 100, {.all = 100, .row = 100, .column = 0}), 17);
}

}  // namespace
}  // namespace slsd
