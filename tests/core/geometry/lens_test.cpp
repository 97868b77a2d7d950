// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/lens.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/geometry/ray_table.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

RC_GTEST_PROP(Undistort, InvertsDistort, ()) {
  const Lens lens = any_distorted_lens();
  RC_PRE(lens.invertible());
  const Eigen::Vector2d pixel = any_pixel(lens);
  RC_ASSERT((lens.distort(lens.undistort(pixel)) - pixel).norm() < 1e-9);
}

RC_GTEST_PROP(DistortJacobian, IsTheDerivativeOfDistort, ()) {
  const Lens lens = any_distorted_lens();
  const Eigen::Vector2d at(uniform(-0.3, 0.3), uniform(-0.3, 0.3));
  const double step = 1e-6;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d offset = step * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d slope = (lens.distort(at + offset) - lens.distort(at - offset)) / (2 * step);
    RC_ASSERT((slope - lens.distort_jacobian(at).col(axis)).norm() < 1e-4);
  }
}

RC_GTEST_PROP(RayTable, AgreesWithUndistort, ()) {
  const Lens lens = any_distorted_lens();
  RC_PRE(lens.invertible());
  const RayTable table(lens);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d pixel = any_pixel(lens);
    const PixelRay ray = table.ray(pixel), plain = pixel_ray(lens, pixel);
    RC_ASSERT((ray.direction - plain.direction).norm() < 1e-9);
    RC_ASSERT((ray.turn - plain.turn).norm() < 1e-4 * plain.turn.norm());
  }
}

TEST(RayTable, StandsAnImageOfOnePixel) {
  const Lens lens{1, 1, 1000, 1000, 0, 0, {}};
  EXPECT_LT(RayTable(lens).ray({0.25, -0.25}).direction.norm(), 1e-3);
}

TEST(Invertible, TellsAFoldedImage) {
  Lens lens{1600, 1200, 1200, 1200, 800, 600, {}};
  EXPECT_TRUE(lens.invertible());
  lens.distortion = {-0.28, 0.08, 0, 0, 0};
  EXPECT_TRUE(lens.invertible());
  lens.distortion = {-0.9, 0, 0, 0, 0};  // r (1 - 0.9 r^2) turns back at r = 0.61; the corner is at 0.83
  EXPECT_FALSE(lens.invertible());
  lens.distortion = {0, 0, 3, 3, 0};
  EXPECT_FALSE(lens.invertible());
}

TEST(Invertible, TellsAFoldThatComesBackWithinTheImage) {
  // Falls between r = 0.39 and 0.63 and rises after: corners alone would not show it.
  const Lens lens{1600, 1200, 900, 900, 800, 600, {-2.8, 3.3, 0, 0, 0}};
  EXPECT_FALSE(lens.invertible());
}

}  // namespace
}  // namespace slsd
