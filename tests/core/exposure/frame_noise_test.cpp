// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_noise.hpp"

#include <random>

#include <gmock/gmock.h>

namespace slsd {
namespace {

/// Squares of light on a dark ground; the noise may grow with the light.
Grey8 lit_squares(double noise, double per_level = 0, double full = 255) {
  Grey8 frame(640, 480);
  std::mt19937 random(5);
  std::normal_distribution<double> gauss(0, 1);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double level = x % 24 < 12 && y % 24 < 12 ? 180 : 30;
      const double grey = level + std::sqrt(noise * noise + per_level * level) * gauss(random);
      frame.at(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, full)));
    }
  }
  return frame;
}

TEST(MeasureNoise, IsThatOfThePixels) {
  for (const double noise : {1.0, 2.0, 6.0, 15.0}) {
    const FrameNoise measured = measure_noise(lit_squares(noise).view(), 255);
    EXPECT_NEAR(measured.at(30), noise, 0.15 * noise + 0.1) << noise;
    EXPECT_NEAR(measured.at(180), noise, 0.2 * noise + 0.1) << noise;
  }
}

TEST(MeasureNoise, GrowsWithTheLight) {
  const FrameNoise measured = measure_noise(lit_squares(1, 0.05).view(), 255);
  EXPECT_NEAR(measured.at(30), std::sqrt(1 + 1.5), 0.4);
  EXPECT_NEAR(measured.at(180), std::sqrt(1 + 9.0), 0.6);
}

TEST(MeasureNoise, OfNothingIsThatOfRounding) {
  EXPECT_NEAR(measure_noise(lit_squares(0).view(), 255).at(100), std::sqrt(1 / 12.), 0.05);
  EXPECT_NEAR(measure_noise(Grey8(1, 1).view(), 255).at(100), std::sqrt(1 / 12.), 0.05);
  EXPECT_NEAR(measure_noise(Grey8(640, 480, 255).view(), 255).at(100), std::sqrt(1 / 12.), 0.05);
}

TEST(MeasureNoise, DoesNotCountSaturatedPixels) {
  EXPECT_NEAR(measure_noise(lit_squares(6, 0, 180).view(), 180).at(30), 6, 1);
}

// As small symbols are in a camera: nowhere flat for more than two or three pixels.
TEST(MeasureNoise, TellsItFromTheEdgesOfSmallSymbols) {
  constexpr double kPerLevel = 0.03, kDark = 0.4;
  Grey8 frame(1200, 900);
  std::mt19937 random(11);
  std::normal_distribution<double> gauss(0, 1);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double wave = (1 + std::sin(0.5 * x)) * (1 + std::sin(0.47 * y + 0.02 * x));
      const double level = 5 + 45 * std::min(wave, 3.5);
      frame.at(x, y) = static_cast<std::uint8_t>(
          std::lround(std::max(0., level + std::sqrt(kDark * kDark + kPerLevel * level) * gauss(random))));
    }
  }
  const FrameNoise measured = measure_noise(frame.view(), 255);
  for (const float level : {5.F, 100.F, 160.F}) {
    const double is = std::sqrt(kDark * kDark + kPerLevel * level);
    EXPECT_NEAR(measured.at(level), is, 0.5 * is) << level;
  }
}

}  // namespace
}  // namespace slsd
