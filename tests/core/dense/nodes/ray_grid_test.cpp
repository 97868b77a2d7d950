// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/nodes/ray_grid.hpp"

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(RayGrid, IsTheLens) {
  Lens lens{1000, 701, 900, 910, 480, 352, {-0.25, 0.1, 0.002, -0.001, 0}};
  const RayGrid rays(lens);
  double worst_px = 0;
  for (int y = 0; y < lens.height_px; y += 7) {
    for (int x = 0; x < lens.width_px; x += 3) {
      const Eigen::Vector2d back = lens.distort(rays.at(x, y).cast<double>());
      worst_px = std::max(worst_px, (back - Eigen::Vector2d(x, y)).norm());
    }
  }
  EXPECT_LT(worst_px, 0.01);
}

TEST(RayGrid, ReachesTheLastPixel) {
  for (const int size : {8, 9, 16, 17}) {
    const Lens lens{size, size, 100, 100, 4, 4, {}};
    const RayGrid rays(lens);
    const Eigen::Vector2f ray = rays.at(size - 1, size - 1);
    EXPECT_NEAR(ray.x(), (size - 1 - 4) / 100.0, 1e-6);
    EXPECT_NEAR(ray.y(), (size - 1 - 4) / 100.0, 1e-6);
  }
}

}  // namespace
}  // namespace slsd
