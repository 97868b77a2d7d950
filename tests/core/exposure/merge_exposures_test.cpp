// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/merge_exposures.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>

#include "core/exposure/frame_noise.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

constexpr double kRounding = 0.5 * 257 + 1;  // of a level of 8 bits
constexpr int kWidth = 320, kHeight = 240;
constexpr double kBend = 0.97 * 4095;  // above it the longer frame is not used

/// A simulated sensor; dark_noise and variance_per_level are in levels of 8 bits.
struct Sensor {
  double full = 255;
  double black = 0;
  double dark_noise = 0.6;
  double variance_per_level = 0.05;
  double gamma = 1;
};

/// Light of small symbols on a surface that grows brighter to the right, 1 at the left up to 500, in levels of
/// exposure 1.
double light_at(int x, int y, int moved_px = 0) {
  const bool lit = (x + moved_px) % 12 < 6 && y % 12 < 6;
  return (lit ? 1.0 : 0.15) * std::exp(std::log(500.0) * x / kWidth);
}

template <class T>
Image<T> exposed(const Sensor& sensor, double exposure, unsigned seed, int moved_px = 0) {
  Image<T> frame(kWidth, kHeight);
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double light = sensor.full * std::pow(exposure * light_at(x, y, moved_px) / 255, sensor.gamma);
      const double scale = sensor.full / 255;
      const double variance =
          sensor.dark_noise * sensor.dark_noise * scale * scale + sensor.variance_per_level * light * scale;
      const double level = sensor.black + light + std::sqrt(variance) * gauss(random);
      frame.at(x, y) = static_cast<T>(std::lround(std::clamp(level, 0.0, sensor.full)));
    }
  }
  return frame;
}

/// Root of the mean square error of a frame's levels, in levels of exposure 1, over columns without saturation.
template <class T>
double error_of(const Image<T>& frame, double full, double black, int left, int right) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = left; x < right; ++x, ++count)
      sum += std::pow((static_cast<double>(frame.at(x, y)) / full * 255 - black) - light_at(x, y), 2);
  }
  return std::sqrt(sum / count);
}

TEST(MergeExposures, HasLessNoiseWhereItIsDark) {
  const Sensor sensor;
  const auto shorter = exposed<std::uint8_t>(sensor, 1, 1), longer = exposed<std::uint8_t>(sensor, 4, 2);
  const auto merged = merge_exposures(shorter.view(), longer.view(), 255, 4);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_NEAR(merged->brighter, 4, 0.05);
  EXPECT_LT(merged->unlike_share, 0.001);
  // The best possible variance: that of light five times as strong, and of darkness in the longer frame alone or
  // better.
  const double before = error_of(shorter, 255, 0, 0, 160), after = error_of(merged->image, kMergedFull, 0, 0, 160);
  EXPECT_LT(after, 0.45 * before);
  EXPECT_LE(error_of(merged->image, kMergedFull, 0, 160, 300), error_of(shorter, 255, 0, 160, 300) * 1.01);
}

TEST(MergeExposures, KeepsSaturationOfTheShorterFrameOnly) {
  const Sensor sensor;
  const auto shorter = exposed<std::uint8_t>(sensor, 1, 1), longer = exposed<std::uint8_t>(sensor, 4, 2);
  const auto merged = merge_exposures(shorter.view(), longer.view(), 255, 4);
  ASSERT_TRUE(merged);
  int saturated = 0, only_longer = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(merged->image.at(x, y) == 65535, shorter.at(x, y) == 255);
      saturated += shorter.at(x, y) == 255;
      only_longer += longer.at(x, y) == 255 && shorter.at(x, y) < 255;
    }
  }
  EXPECT_GT(saturated, 1000);
  EXPECT_GT(only_longer, 5000);
}

// Written pixel by pixel, with the line that the frames were made by.
TEST(MergeExposures, EqualsThePlainWeightedMean) {
  const Sensor sensor{.full = 4095, .black = 64};
  const auto shorter = exposed<std::uint16_t>(sensor, 1, 3), longer = exposed<std::uint16_t>(sensor, 3, 4);
  const auto merged = merge_exposures(shorter.view(), longer.view(), 4095, 3);
  ASSERT_TRUE(merged) << merged.error().message;
  const FrameNoise of_shorter = measure_noise(shorter.view(), 4095), of_longer = measure_noise(longer.view(), 4095);
  int unlike = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double s = shorter.at(x, y), l = longer.at(x, y), expected = (l - 64) / 3 + 64;
      const double var_s = std::pow(of_shorter.at(static_cast<float>(expected)), 2);
      const double var_l = std::pow(of_longer.at(static_cast<float>(l)) / 3, 2);
      const double mean = l < kBend ? (s / var_s + expected / var_l) / (1 / var_s + 1 / var_l) : s;
      const double got = merged->image.at(x, y) / 65535.0 * 4095;
      // The fitted line differs by a thousandth from the true one.
      if (std::abs(got - mean) <= (l < kBend ? 0.001 * 4095 / 3 : 0.54)) continue;
      EXPECT_NEAR(got, s, 0.54) << x << " " << y;
      ++unlike;
    }
  }
  EXPECT_LE(unlike, std::lround(merged->unlike_share * kWidth * kHeight));
  EXPECT_LT(merged->unlike_share, 0.0005);
}

TEST(MergeExposures, CancelsTheBlackLevelAndRoundedExposures) {
  for (const double black : {0.0, 8.0, 20.0}) {
    for (const double exposure : {3.3, 4.0, 5.0}) {
      const Sensor sensor{.black = black};
      const auto shorter = exposed<std::uint8_t>(sensor, 1, 1), longer = exposed<std::uint8_t>(sensor, exposure, 2);
      const auto merged = merge_exposures(shorter.view(), longer.view(), 255, 4);
      ASSERT_TRUE(merged) << black << " " << exposure << " " << merged.error().message;
      EXPECT_NEAR(merged->brighter, exposure, 0.03 * exposure) << black;
      EXPECT_LT(error_of(merged->image, kMergedFull, black, 0, 160), 0.6 * error_of(shorter, 255, black, 0, 160));
    }
  }
}

TEST(MergeExposures, DoesNotDependOnTheDepth) {
  const Sensor of8{.full = 255}, of16{.full = 65535};
  const auto merge8 =
      merge_exposures(exposed<std::uint8_t>(of8, 1, 1).view(), exposed<std::uint8_t>(of8, 4, 2).view(), 255, 4);
  const auto merge16 =
      merge_exposures(exposed<std::uint16_t>(of16, 1, 1).view(), exposed<std::uint16_t>(of16, 4, 2).view(), 65535, 4);
  ASSERT_TRUE(merge8) << merge8.error().message;
  ASSERT_TRUE(merge16) << merge16.error().message;
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < 300; ++x) sum += merge8->image.at(x, y) - static_cast<double>(merge16->image.at(x, y));
  EXPECT_LT(std::abs(sum / (kHeight * 300)), 0.2 * 257);  // levels of 8 bits
}

TEST(MergeExposures, RefusesAMovedScene) {
  const Sensor sensor;
  const auto merged = merge_exposures(exposed<std::uint8_t>(sensor, 1, 1).view(),
                                      exposed<std::uint8_t>(sensor, 4, 2, 2).view(), 255, 4);
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(merged.error().message, HasSubstr("changed"));
}

TEST(MergeExposures, KeepsTheShorterFrameWhereLittleMoved) {
  const Sensor sensor;
  const auto shorter = exposed<std::uint8_t>(sensor, 1, 1);
  auto longer = exposed<std::uint8_t>(sensor, 4, 2);
  for (int y = 100; y < 120; ++y)
    for (int x = 200; x < 220; ++x) longer.at(x, y) = 5;
  const auto merged = merge_exposures(shorter.view(), longer.view(), 255, 4);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_GT(merged->unlike_share, 300.0 / (kWidth * kHeight));
  for (int y = 108; y < 114; ++y) EXPECT_NEAR(merged->image.at(206, y), shorter.at(206, y) * 257, kRounding);
}

TEST(MergeExposures, RefusesABrightnessThatDoesNotFollowTheExposure) {
  const Sensor sensor;
  const Sensor bent{.gamma = 0.6};
  const auto shorter = exposed<std::uint8_t>(sensor, 1, 1);
  for (const double exposure : {1.0, 2.0, 7.0}) {  // ignored, or changed between the two frames
    const auto merged = merge_exposures(shorter.view(), exposed<std::uint8_t>(sensor, exposure, 2).view(), 255, 4);
    ASSERT_FALSE(merged) << exposure;
    EXPECT_EQ(merged.error().code, ErrorCode::kMismatch);
    EXPECT_THAT(merged.error().message, HasSubstr("not 4.00 times")) << exposure;
  }
  EXPECT_FALSE(
      merge_exposures(exposed<std::uint8_t>(bent, 1, 1).view(), exposed<std::uint8_t>(bent, 4, 2).view(), 255, 4));
  EXPECT_FALSE(merge_exposures(exposed<std::uint8_t>(sensor, 4, 1).view(), shorter.view(), 255, 4)) << "exchanged";
}

TEST(MergeExposures, TakesAFrameThatIsBlackOrSaturated) {
  const Grey8 black(kWidth, kHeight, 0), white(kWidth, kHeight, 255);
  const auto of_black = merge_exposures(black.view(), black.view(), 255, 4);
  ASSERT_TRUE(of_black) << of_black.error().message;
  EXPECT_EQ(of_black->image, Grey16(kWidth, kHeight, 0));
  const auto of_white = merge_exposures(white.view(), white.view(), 255, 4);
  ASSERT_TRUE(of_white) << of_white.error().message;
  EXPECT_EQ(of_white->image, Grey16(kWidth, kHeight, 65535));
  const auto shorter = exposed<std::uint8_t>(Sensor{.black = 80}, 1, 1);
  const auto of_longer_white = merge_exposures(shorter.view(), white.view(), 255, 4);
  ASSERT_TRUE(of_longer_white) << of_longer_white.error().message;
  EXPECT_NEAR(of_longer_white->image.at(10, 10), shorter.at(10, 10) * 257, kRounding);
  EXPECT_FALSE(merge_exposures(black.view(), white.view(), 255, 4));
  EXPECT_FALSE(merge_exposures(shorter.view(), black.view(), 255, 4));
}

TEST(MergeExposures, GivesOneExposureTheSameLevels) {
  const auto shorter = exposed<std::uint8_t>(Sensor{}, 1, 1);
  const Grey16 converted = as_merged(shorter.view(), 255);
  EXPECT_EQ(converted, merge_exposures(shorter.view(), Grey8(kWidth, kHeight, 255).view(), 255, 1000)->image);
  EXPECT_NEAR(converted.at(10, 10), shorter.at(10, 10) * 257, kRounding);
  const Sensor sensor;
  const double noise = 257 * std::sqrt(sensor.dark_noise * sensor.dark_noise + 100 * sensor.variance_per_level);
  EXPECT_NEAR(measure_noise(converted.view(), kMergedFull).at(100 * 257), noise, 0.25 * noise);
  Grey16 of_12_bits(2, 1);
  of_12_bits.at(0, 0) = 4094, of_12_bits.at(1, 0) = 4095;
  EXPECT_NEAR(as_merged(of_12_bits.view(), 4095).at(0, 0), 65519, 9);
  EXPECT_EQ(as_merged(of_12_bits.view(), 4095).at(1, 0), 65535);
}

TEST(NeedsSecondExposure, IfNoneSuitsBrightAndFaintSymbols) {
  const LightLevels both{.lit_faintest = 20, .clipped_share = 0.3};
  EXPECT_TRUE(needs_second_exposure(both));
  EXPECT_FALSE(needs_second_exposure({.lit_faintest = 60, .clipped_share = 0.3})) << "a shorter exposure suits";
  EXPECT_FALSE(needs_second_exposure({.lit_faintest = 20, .clipped_share = 0.03})) << "a shiny spot";
  EXPECT_FALSE(needs_second_exposure(LightLevels{}));
}

TEST(MergeExposures, RefusesWhatDoesNotBelongTogether) {
  const Grey8 frame(64, 48, 20);
  EXPECT_EQ(merge_exposures(frame.view(), Grey8(64, 47, 20).view(), 255, 4).error().code, ErrorCode::kMismatch);
  EXPECT_EQ(merge_exposures(frame.view(), Grey16(64, 48, 20).view(), 255, 4).error().code, ErrorCode::kMismatch);
  for (const double ratio : {1.0, 0.5, 0.0, -4.0, std::nan(""), double{INFINITY}})
    EXPECT_EQ(merge_exposures(frame.view(), frame.view(), 255, ratio).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(merge_exposures(frame.view(), frame.view(), 0, 4).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(merge_exposures(Grey8().view(), Grey8().view(), 255, 4));
  EXPECT_TRUE(merge_exposures(Grey8(3, 2, 5).view(), Grey8(3, 2, 20).view(), 255, 4));
}

/// The shorter and the longer exposure of one picture.
struct TwoFrames {
  Grey8 shorter, longer;
  [[nodiscard]] ExposurePair pair() const { return {shorter.view(), longer.view()}; }
};

TwoFrames two_frames(double ratio, unsigned seed) {
  return {exposed<std::uint8_t>({}, 1, seed), exposed<std::uint8_t>({}, ratio, seed + 1)};
}

TEST(MergePictures, MergesEachPair) {
  const TwoFrames pattern = two_frames(4, 1), white = two_frames(4, 3);
  const MergedPictures merged = merge_pictures(std::vector{pattern.pair(), white.pair()}, 255, 4);
  EXPECT_EQ(merged.problem, "");
  ASSERT_EQ(merged.images.size(), 2U);
  EXPECT_EQ(merged.images[0], merge_exposures(pattern.shorter.view(), pattern.longer.view(), 255, 4)->image);
  EXPECT_EQ(merged.images[1], merge_exposures(white.shorter.view(), white.longer.view(), 255, 4)->image);
}

TEST(MergePictures, LeavesAllShorterOnesIfOnePairDoesNotMerge) {
  const TwoFrames pattern = two_frames(4, 1), same = two_frames(1, 3);
  for (const bool first : {false, true}) {
    const std::vector pairs{first ? same.pair() : pattern.pair(), first ? pattern.pair() : same.pair()};
    const MergedPictures merged = merge_pictures(pairs, 255, 4);
    EXPECT_THAT(merged.problem, HasSubstr("times as bright"));
    ASSERT_EQ(merged.images.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(merged.images[i], as_merged(pairs[i].shorter, 255));
  }
}

}  // namespace
}  // namespace slsd
