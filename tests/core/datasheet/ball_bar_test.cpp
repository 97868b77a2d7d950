// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/ball_bar.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include <Eigen/Geometry>

namespace slsd {
namespace {

TEST(BallBar, IsClosedAndOfItsSize) {
  const Mesh bar = ball_bar(40, 200);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  double volume = 0;
  for (const auto& [a, b, c] : bar.triangles) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) ++edges[{from, to}];
    volume += bar.vertices_mm[a].cross(bar.vertices_mm[b]).dot(bar.vertices_mm[c]) / 6;
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ((edges[{edge.second, edge.first}]), 1);
  }
  const double spheres = 2 * 4 / 3.0 * std::numbers::pi * 8000, rod = std::numbers::pi * 49 * 200;
  EXPECT_NEAR(volume, spheres + rod, 0.01 * spheres);
  float most = 0;
  for (const Eigen::Vector3f& vertex : bar.vertices_mm) most = std::max(most, vertex.x());
  EXPECT_NEAR(most, 120, 0.05);
}

}  // namespace
}  // namespace slsd
