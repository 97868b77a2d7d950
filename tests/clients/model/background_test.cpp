// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/background.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "bumpy_ball.hpp"

namespace slsd::model {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// A ball moved back in the frame of the object, whose front is a background 20 mm behind the object's.
float ball_behind(const Eigen::Vector3f& at) {
  return bumpy_ball(at - Eigen::Vector3f(0, 0, 20));
}

std::size_t measured(const std::vector<RangeImage>& images) {
  std::size_t count = 0;
  for (const RangeImage& image : images)
    for (const float depth : image.depth_mm) count += std::isnan(depth) ? 0 : 1;
  return count;
}

std::vector<RangeImage> images_of(const Distance& distance, unsigned seed) {
  return *range_images(measure(distance, rig_from_object(0), 0.05F, seed), test_calibration(), std::nullopt);
}

TEST(Background, HidesASceneMeasuredOnceMore) {
  const auto background = Background::of(measure(bumpy_ball, rig_from_object(0), 0.05F, 1), test_calibration());
  ASSERT_TRUE(background.has_value());
  std::vector<RangeImage> images = images_of(bumpy_ball, 2);
  background->remove_from(images);
  EXPECT_TRUE(images.empty());
}

TEST(Background, LeavesWhatStandsInFront) {
  const auto background = Background::of(measure(ball_behind, rig_from_object(0), 0.05F, 1), test_calibration());
  ASSERT_TRUE(background.has_value());
  std::vector<RangeImage> images = images_of(bumpy_ball, 2);
  const std::size_t all = measured(images);
  background->remove_from(images);
  EXPECT_GT(measured(images), 95 * all / 100);
}

TEST(Background, RefusesNoPointsAndAnotherCalibration) {
  EXPECT_EQ(Background::of({}, test_calibration()).error().code, ErrorCode::kMalformed);
  Calibration other = test_calibration();
  other.cameras[0].lens.fx *= 1.01;
  const auto points = measure(bumpy_ball, rig_from_object(0), 0.05F, 1);
  EXPECT_EQ(Background::of(points, other).error().code, ErrorCode::kMismatch);
}

TEST(RangeImage, TrimsToTheMeasuredPixels) {
  RangeImage image;
  image.left = 10, image.top = 20, image.width = 4, image.height = 3;
  image.depth_mm = {kNone, kNone, kNone, kNone, kNone, 5, kNone, kNone, kNone, kNone, 7, kNone};
  image.sigma_mm = {0, 0, 0, 0, 0, 1, 2, 0, 0, 3, 4, 0};
  image.intensity = {0, 0, 0, 0, 0, 50, 60, 0, 0, 70, 80, 0};
  image.trim();
  EXPECT_EQ((std::vector{image.left, image.top, image.width, image.height}), (std::vector{11, 21, 2, 2}));
  EXPECT_EQ(image.sigma_mm, (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(image.intensity, (std::vector<std::uint8_t>{50, 60, 70, 80}));
  EXPECT_EQ(image.depth_mm[image.index(1, 1)], 7);
  image.depth_mm.assign(4, kNone);
  image.trim();
  EXPECT_EQ((std::vector{image.width, image.height}), (std::vector{0, 0}));
  EXPECT_TRUE(image.depth_mm.empty());
}

}  // namespace
}  // namespace slsd::model
