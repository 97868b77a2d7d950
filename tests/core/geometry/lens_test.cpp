// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/lens.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/calib3d.hpp>

#include "core/geometry/ray_table.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

Lens any_lens() {
  Lens lens{1600, 1200, uniform(2000, 4000), uniform(2000, 4000), uniform(700, 900), uniform(500, 700), {}};
  lens.distortion = {uniform(-0.25, 0.25), uniform(-0.2, 0.2), uniform(-0.003, 0.003), uniform(-0.003, 0.003),
                     uniform(-0.05, 0.05)};
  return lens;
}

RC_GTEST_PROP(Undistort, InvertsDistort, ()) {
  const Lens lens = any_lens();
  RC_PRE(lens.invertible());
  const Eigen::Vector2d pixel = any_pixel(lens);
  RC_ASSERT((lens.distort(lens.undistort(pixel)) - pixel).norm() < 1e-9);
}

RC_GTEST_PROP(Project, AgreesWithOpenCv, ()) {
  const Lens lens = any_lens();
  const Eigen::Vector3d point(uniform(-500, 500), uniform(-400, 400), uniform(1500, 2500));
  const cv::Matx33d pinhole(lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(), pinhole,
                    std::vector<double>(lens.distortion.begin(), lens.distortion.end()), seen);
  RC_ASSERT((lens.project(point) - Eigen::Vector2d(seen[0].x, seen[0].y)).norm() < 1e-9);
}

RC_GTEST_PROP(DistortJacobian, IsTheDerivativeOfDistort, ()) {
  const Lens lens = any_lens();
  const Eigen::Vector2d at(uniform(-0.3, 0.3), uniform(-0.3, 0.3));
  const double step = 1e-6;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d offset = step * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d slope = (lens.distort(at + offset) - lens.distort(at - offset)) / (2 * step);
    RC_ASSERT((slope - lens.distort_jacobian(at).col(axis)).norm() < 1e-4);
  }
}

RC_GTEST_PROP(RayTable, AgreesWithUndistort, ()) {
  const Lens lens = any_lens();
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
