// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/plane_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace slsd {
namespace {

TEST(FitPlane, FindsThePlaneAmongPointsElsewhere) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> across(-300, 300);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.1, 1).normalized(), middle(10, 20, 2000);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 500; ++i) {
    const double x = across(random), y = across(random);
    const double z = -(normal.x() * x + normal.y() * y) / normal.z() + (i % 5 < 2 ? 50 + std::abs(across(random)) : 0);
    points.push_back(middle + Eigen::Vector3d(x, y, z));
  }
  const auto plane = fit_plane(points);
  ASSERT_TRUE(plane);
  EXPECT_EQ(plane->on_plane.size(), 300U);
  EXPECT_LT((plane->normal - normal).norm(), 1e-9);
  EXPECT_LT(plane->rms_mm, 1e-5);
  EXPECT_LT(std::abs(plane->off_mm(plane->meet({0.05, -0.02}))), 1e-9);
}

TEST(FitPlane, RefusesALine) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 50; ++i) points.emplace_back(i, 2 * i, 1000 + 3 * i);
  EXPECT_FALSE(fit_plane(points));
  EXPECT_FALSE(fit_plane(std::span(points).first(2)));
}

}  // namespace
}  // namespace slsd
