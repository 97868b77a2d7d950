// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/divide_light.hpp"

#include <algorithm>
#include <cmath>
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

TEST(DivideLight, TakesTheSameFromInkAsFromPaper) {
  Grey16 white(2, 1), lit(2, 1);
  white.at(0, 0) = 60000, lit.at(0, 0) = 30000;
  white.at(1, 0) = 3000, lit.at(1, 0) = 1500;
  const auto quotient = divide_light(lit.view(), white.view());
  ASSERT_TRUE(quotient);
  EXPECT_NEAR(quotient->at(0, 0), 25000, 20);
  EXPECT_NEAR(quotient->at(1, 0), 25000, 20);
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

constexpr int kPeriod = 48;  // px along x + y

/// Light that rises and falls along x + y, on ink above and on paper below, above a black level; a camera that blurs.
struct Print {
  double black_level = 0, blur_px = 0;  // of 255; along y alone

  [[nodiscard]] static double light(double x, double y) {
    return 0.9 * std::max(0.0, std::abs(std::fmod(x + y, kPeriod) / (0.5 * kPeriod) - 1) - 0.4);
  }
  [[nodiscard]] Grey16 seen(bool white) const {
    Grey16 image(200, 100);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        double sum = 0, weights = 0;
        for (int i = -40; i <= 40; ++i) {
          const double from = y + 0.1 * i * blur_px, weight = std::exp(-0.005 * i * i);
          sum += weight * (from < 49.5 ? 0.1 : 0.9) * ((white ? 1 : light(x, from)) + 0.1), weights += weight;
        }
        image.at(x, y) = static_cast<std::uint16_t>(257 * black_level + 50000 * sum / weights);
      }
    }
    return image;
  }
  [[nodiscard]] Grey16 divided() const {
    return divide_light(seen(false).view(), seen(true).view(), PrintedSurface{[](int, int) { return true; }, blur_px})
        ->quotient;
  }
  [[nodiscard]] Grey16 plainly_divided() const { return *divide_light(seen(false).view(), seen(true).view()); }
};

/// The share of white that the light is, with the room's tenth.
double share(int x, int y) {
  return kAsBrightAsWhite * (Print::light(x, y) + 0.1) / 1.1;
}

TEST(DivideLight, FindsTheBlackLevelOnAPrint) {
  const Print print{.black_level = 9};
  const Grey16 quotient = print.divided();
  double plain_off = 0;
  for (const int y : {20, 80}) {
    for (int x = 0; x < 200; ++x) {
      EXPECT_NEAR(quotient.at(x, y), share(x, y), 300) << x << ", " << y;
      plain_off = std::max(plain_off, std::abs(print.plainly_divided().at(x, y) - share(x, y)));
    }
  }
  EXPECT_GT(plain_off, 10000);
}

TEST(DivideLight, UndoesWhatTheCamerasBlurMovesAtAnEdge) {
  const Print print{.black_level = 3, .blur_px = 0.8};
  const Grey16 quotient = print.divided(), plain = print.plainly_divided();
  double off = 0, plain_off = 0;
  for (int y = 44; y < 56; ++y) {
    for (int x = 0; x < 200; ++x) {
      const int at = (x + y) % kPeriod;  // not where the light's slope changes
      if (at < 4 || (at > 10 && at < 38) || at > 44) continue;
      off = std::max(off, std::abs(quotient.at(x, y) - share(x, y)));
      plain_off = std::max(plain_off, std::abs(plain.at(x, y) - share(x, y)));
    }
  }
  EXPECT_LT(off, 1300);
  EXPECT_GT(plain_off, 4 * off);
}

TEST(DivideLight, RefusesPicturesOfTwoSizes) {
  const Grey8 white(4, 4), lit(4, 5);
  EXPECT_EQ(divide_light(lit.view(), white.view()).error().code, ErrorCode::kMismatch);
  EXPECT_THAT(divide_light(white.view(), white.view(), lit.view()).error().message, testing::HasSubstr("black image"));
}

}  // namespace
}  // namespace slsd
