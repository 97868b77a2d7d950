// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/tone_curve.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(ToneCurve, IsStraightNearOneAndLimited) {
  ToneCurve tone;
  for (const float power : {1.F, 1.2F, 0.95F, std::numeric_limits<float>::quiet_NaN()}) {
    tone.set_power(power);
    EXPECT_TRUE(tone.is_straight()) << power;
  }
  tone.set_power(0.7F);
  EXPECT_FALSE(tone.is_straight());
  EXPECT_FLOAT_EQ(tone.power(), 0.7F);
  tone.set_power(-3);
  EXPECT_FLOAT_EQ(tone.power(), 0.3F);
}

TEST(ToneCurve, LightOfEightAndSixteenBitsIsThePower) {
  Grey8 eight(3, 1);
  Grey16 twelve(3, 1);
  const double levels[] = {0, 100, 255};
  for (int x = 0; x < 3; ++x) {
    eight.at(x, 0) = static_cast<std::uint8_t>(levels[x]);
    twelve.at(x, 0) = static_cast<std::uint16_t>(std::lround(levels[x] * 4095 / 255));
  }
  ToneCurve tone;
  for (const double power : {0.5, 0.7}) {
    tone.set_power(static_cast<float>(power));
    for (int x = 0; x < 3; ++x) {
      const double light = ToneCurve::kFull * std::pow(levels[x] / 255, 1 / power);
      EXPECT_NEAR(tone.light_of(eight.view(), 255).at(x, 0), light, 1);
      EXPECT_NEAR(tone.light_of(twelve.view(), 4095).at(x, 0), light, 0.001 * light + 1);
      EXPECT_NEAR(tone.light_of(static_cast<float>(levels[x]), 255), light, 1);
    }
  }
}

TEST(ToneCurve, LevelAndLightAreInverse) {
  ToneCurve tone;
  tone.set_power(0.6F);
  for (const int level : {40, 128, 200, 255}) {
    const float light = tone.light_of(static_cast<float>(level), 255) / 257;
    EXPECT_NEAR(tone.levels_of_lights()[static_cast<std::size_t>(std::lround(light))], level, 3);
  }
}

}  // namespace
}  // namespace slsd
