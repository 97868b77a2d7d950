// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/divide_light.hpp"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>

namespace slsd {
namespace {

TEST(DivideLight, TakesThePrintOut) {
  Grey8 white(4, 1), lit(4, 1);
  const int print[] = {200, 100, 60, 1};
  for (int x = 0; x < 4; ++x) {
    white.at(x, 0) = static_cast<std::uint8_t>(print[x]);
    lit.at(x, 0) = static_cast<std::uint8_t>(print[x] / 2);
  }
  const auto quotient = divide_light(lit.view(), white.view());
  ASSERT_TRUE(quotient);
  for (int x = 0; x < 3; ++x) EXPECT_NEAR(quotient->at(x, 0), 25000, 150);
  EXPECT_EQ(quotient->at(3, 0), 0);
}

TEST(DivideLight, TakesTheRoomsLightFromBoth) {
  const Grey8 white(3, 2, 150), lit(3, 2, 100), dark(3, 2, 50);
  const auto quotient = divide_light(lit.view(), white.view(), dark.view());
  ASSERT_TRUE(quotient);
  EXPECT_NEAR(quotient->at(1, 1), 25000, 50);
  const auto brighter_than_white = divide_light(dark.view(), lit.view(), white.view());
  ASSERT_TRUE(brighter_than_white);
  EXPECT_EQ(brighter_than_white->at(1, 1), 0);
}

TEST(DivideLight, OfTwoDepthsIsThatOfOne) {
  const Grey8 white(3, 2, 200), lit(3, 2, 100);
  const Grey16 deep_white(3, 2, 200 * 257);
  const auto quotient = divide_light(lit.view(), deep_white.view());
  ASSERT_TRUE(quotient);
  EXPECT_NEAR(quotient->at(0, 0), 25000, 50);
}

// Where no light falls the quotient of noise by noise may be anything.
TEST(DivideLight, MakesNothingOfNoise) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 4);
  Grey8 white(200, 100), lit(200, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 200; ++x) {
      const double light = x < 100 ? 0 : 200;
      white.at(x, y) = static_cast<std::uint8_t>(std::clamp(light + noise(random), 0., 255.));
      lit.at(x, y) = static_cast<std::uint8_t>(std::clamp(light + noise(random), 0., 255.));
    }
  }
  const auto quotient = divide_light(lit.view(), white.view());
  ASSERT_TRUE(quotient);
  int bright = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 200; ++x) {
      if (x < 100) {
        bright += quotient->at(x, y) > 20000;
      } else {
        EXPECT_GT(quotient->at(x, y), 40000);
      }
    }
  }
  EXPECT_LT(bright, 100);
}

TEST(DivideLight, RefusesPicturesOfTwoSizes) {
  const Grey8 white(4, 4), lit(4, 5);
  EXPECT_EQ(divide_light(lit.view(), white.view()).error().code, ErrorCode::kMismatch);
  EXPECT_THAT(divide_light(white.view(), white.view(), lit.view()).error().message, testing::HasSubstr("black image"));
}

}  // namespace
}  // namespace slsd
