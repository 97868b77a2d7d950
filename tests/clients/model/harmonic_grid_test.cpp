// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/mesh/harmonic_grid.hpp"

#include <algorithm>

#include <gmock/gmock.h>

namespace slsd::model {
namespace {

TEST(HarmonicGrid, IsLinearBetweenPlanes) {
  HarmonicGrid grid({40, 30, 50});
  const auto plane = [](int x, int y, int z) {
    return 0.1F * static_cast<float>(x) - 0.2F * static_cast<float>(y + z);
  };
  const auto is_border = [&](int x, int y, int z) {
    return x == 0 || y == 0 || z == 0 || x == 39 || y == 29 || z == 49;
  };
  for (int z = 0; z < 50; ++z)
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x)
        if (is_border(x, y, z)) grid.fix(grid.index(x, y, z), plane(x, y, z));
  grid.solve();
  for (int z = 0; z < 50; ++z)
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x) ASSERT_NEAR(grid.value(grid.index(x, y, z)), plane(x, y, z), 0.05F);
  EXPECT_NEAR(grid.between({10.5F, 20.25F, 30}), plane(0, 0, 0) + 1.05F - 0.2F * 50.25F, 0.05F);
}

// Between two balls at values a and b, Laplace's equation has the solution p + q / radius.
TEST(HarmonicGrid, FallsAsOneOverTheRadiusBetweenBalls) {
  constexpr int kSide = 81;
  constexpr float kInner = 10, kOuter = 36;
  HarmonicGrid grid({kSide, kSide, kSide});
  const auto radius = [](int x, int y, int z) {
    return (Eigen::Vector3i(x, y, z) - Eigen::Vector3i::Constant(kSide / 2)).cast<float>().norm();
  };
  const float q = -2 / (1 / kInner - 1 / kOuter), p = 1 - q / kOuter;
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const float r = radius(x, y, z);
        if (r <= kInner || r >= kOuter) grid.fix(grid.index(x, y, z), p + q / std::max(r, kInner / 2));
      }
  grid.solve();
  for (int x = kSide / 2 + static_cast<int>(kInner); x < kSide; ++x) {
    const float r = radius(x, kSide / 2, kSide / 2);
    EXPECT_NEAR(grid.value(grid.index(x, kSide / 2, kSide / 2)), p + q / r, 0.02F) << "radius " << r;
  }
}

TEST(HarmonicGrid, KeepsWhatIsFixed) {
  HarmonicGrid grid({12, 12, 12});
  grid.fix_border(3);
  const std::size_t middle = grid.index(6, 6, 6);
  grid.fix(middle, -3);
  grid.solve();
  EXPECT_EQ(grid.value(middle), -3);
  EXPECT_EQ(grid.value(grid.index(0, 5, 5)), 3);
  EXPECT_GT(grid.value(grid.index(3, 6, 6)), grid.value(grid.index(5, 6, 6)));
}

}  // namespace
}  // namespace slsd::model
