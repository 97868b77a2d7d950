// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/half_space.hpp"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Geometry>

namespace slsd {
namespace {

TEST(HalfSpace, HoldsWhatIsBeforeItsPlane) {
  const HalfSpace above{Eigen::Vector3d(0, -1, 0), -800};  // y points down: a table 800 mm below
  EXPECT_TRUE(above.contains({5, 799, 3}));
  EXPECT_FALSE(above.contains({5, 800, 3}));
  EXPECT_FALSE(above.contains({5, 801, 3}));
}

TEST(HalfSpace, HoldsTheSamePointsInAnotherFrame) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-100, 100);
  const auto vector = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
  for (int i = 0; i < 200; ++i) {
    const HalfSpace there{vector().normalized(), number(random)};
    const RigidTransform there_from_here{Eigen::AngleAxisd(number(random), vector().normalized()).toRotationMatrix(),
                                         vector()};
    const HalfSpace here = there.in(there_from_here);
    EXPECT_NEAR(here.normal.norm(), 1, 1e-12);
    const Eigen::Vector3d point = vector();
    EXPECT_NEAR(here.normal.dot(point) - here.offset_mm, there.normal.dot(there_from_here * point) - there.offset_mm,
                1e-9);
  }
}

}  // namespace
}  // namespace slsd
