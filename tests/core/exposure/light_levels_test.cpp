// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/light_levels.hpp"

#include <random>

#include <gmock/gmock.h>

#include "tests/core/exposure/corpus_frame.hpp"

namespace slsd {
namespace {

using ::testing::DoubleNear;

/// Squares of 10 px, 20 px apart.
Grey8 squares(int dark, int lit) {
  Grey8 image(640, 480, static_cast<std::uint8_t>(dark));
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (x % 20 < 10 && y % 20 < 10) image.at(x, y) = static_cast<std::uint8_t>(lit);
    }
  }
  return image;
}

TEST(MeasureLight, TellsTheLevelsOfAPattern) {
  const LightLevels levels = measure_light(squares(20, 180).view(), 255);
  EXPECT_EQ(levels.dark, 20);
  EXPECT_EQ(levels.lit, 180);
  EXPECT_EQ(levels.lit_brightest, 180);
  EXPECT_EQ(levels.clipped_share, 0);
  EXPECT_EQ(levels.patterned_share, 1);
  EXPECT_THAT(levels.edge_px, DoubleNear(0.8, 0.01));
  EXPECT_THAT(levels.period_px, DoubleNear(40, 6));  // every second row has no squares
}

TEST(MeasureLight, SeesNoPatternInNoiseAndInShade) {
  std::mt19937 random(1);
  Grey8 noise(640, 480);
  for (std::size_t i = 0; i < noise.size(); ++i) noise.data()[i] = static_cast<std::uint8_t>(random() % 256);
  EXPECT_EQ(measure_light(noise.view(), 255).patterned_share, 0);
  EXPECT_EQ(measure_light(Grey8(640, 480, 90).view(), 255).patterned_share, 0);
  EXPECT_EQ(measure_light(Grey8(20, 20, 90).view(), 255).patterned_share, 0);
  Grey8 edge(640, 480, 10);
  for (int y = 0; y < 480; ++y) std::fill(edge.row(y) + 320, edge.row(y) + 640, std::uint8_t{200});
  EXPECT_EQ(measure_light(edge.view(), 255).patterned_share, 0);
}

TEST(MeasureLight, FollowsTheExposure) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const LightLevels once = measure_light(frame.view(), 255);
  const LightLevels half = measure_light(exposed(frame, 0.5).view(), 255);
  EXPECT_THAT(half.lit / once.lit, DoubleNear(0.5, 0.02));
  EXPECT_THAT(half.lit_brightest / once.lit_brightest, DoubleNear(0.5, 0.02));
  EXPECT_THAT(half.edge_px, DoubleNear(once.edge_px, 0.05));
  EXPECT_THAT(half.period_px, DoubleNear(once.period_px, 1));
  EXPECT_GT(measure_light(exposed(frame, 4).view(), 255).clipped_share, 0.9);
}

TEST(MeasureLight, IsTheSameIn16Bits) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const LightLevels narrow = measure_light(frame.view(), 255);
  const LightLevels wide = measure_light(exposed<std::uint16_t>(frame, 1, 0, 4095).view(), 4095);
  EXPECT_THAT(wide.lit / 4095, DoubleNear(narrow.lit / 255, 0.002));
  EXPECT_THAT(wide.edge_px, DoubleNear(narrow.edge_px, 0.02));
  EXPECT_THAT(wide.patterned_share, DoubleNear(narrow.patterned_share, 0.02));
}

TEST(MeasureLight, SeesEdgesWiden) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const LightLevels sharp = measure_light(frame.view(), 255);
  const LightLevels soft = measure_light(blurred(frame, 2).view(), 255);
  EXPECT_GT(soft.edge_px, 2 * sharp.edge_px);
}

TEST(GuessFullLevel, IsOfTheBitsInUse) {
  EXPECT_EQ(guess_full_level(Grey8(4, 4, 3).view()), 255);
  EXPECT_EQ(guess_full_level(Grey16(4, 4, 1000).view()), 1023);
  EXPECT_EQ(guess_full_level(Grey16(4, 4, 1024).view()), 4095);
  EXPECT_EQ(guess_full_level(Grey16(4, 4, 16383).view()), 16383);
  EXPECT_EQ(guess_full_level(Grey16(4, 4, 65535).view()), 65535);
}

TEST(HeldFullLevel, DoesNotFallWithAFaintFrame) {
  HeldFullLevel held;
  EXPECT_EQ(held.of(Grey16(4, 4, 1000).view()), 1023);
  EXPECT_EQ(held.of(Grey16(4, 4, 1024).view()), 4095);
  EXPECT_EQ(held.of(Grey16(4, 4, 1000).view()), 4095);
  EXPECT_EQ(held.of(Grey8(4, 4, 100).view()), 255);
  EXPECT_EQ(held.of(Grey16(4, 4, 10).view()), 4095);
}

TEST(FullLevel, IsWhatTheFormatSays) {
  const Grey16 faint(4, 4, 20);
  for (const char* format : {"Y10", "Mono10", "Mono10p", "Mono10Packed", "BayerRG10", "BayerRG10p", "RG10", "Y10P"})
    EXPECT_EQ(full_level(format, faint.view()), 1023) << format;
  for (const char* format : {"Y12", "Mono12", "Mono12p", "Mono12Packed", "BayerGB12Packed", "BG12", "Mono12g24IDS"})
    EXPECT_EQ(full_level(format, faint.view()), 4095) << format;
  for (const char* format : {"Y14", "Mono14", "Mono14p", "BayerBG14"})
    EXPECT_EQ(full_level(format, faint.view()), 16383) << format;
}

TEST(FullLevel, IsGuessedWhereTheFormatDoesNotSay) {
  for (const char* format : {"", "Y16", "Y16 ", "Mono16", "GREY", "pBAA", "Mono", "999999999999"}) {
    EXPECT_EQ(full_level(format, Grey16(4, 4, 1000).view()), 1023) << format;
    EXPECT_EQ(full_level(format, Grey16(4, 4, 3000).view()), 4095) << format;
    EXPECT_EQ(full_level(format, Grey16(4, 4, 40000).view()), 65535) << format;
  }
}

TEST(FullLevel, OfAByteIs255WhateverTheFormat) {
  for (const char* format : {"", "GREY", "Mono8", "Mono12p", "JPEG"})
    EXPECT_EQ(full_level(format, Grey8(4, 4, 200).view()), 255) << format;
}

// Some cameras fill the upper bits in spite of the name.
TEST(FullLevel, IsNotBelowAPixel) {
  EXPECT_EQ(full_level("Y10", Grey16(4, 4, 64 * 900).view()), 65535);
}

TEST(FullLevel, IsTheHighestOfSeveralFrames) {
  const Grey16 bright(4, 4, 3000), dark(4, 4, 20);
  const std::vector<GreyView> frames{bright.view(), dark.view()};
  EXPECT_EQ(full_level("", frames), 4095);
  EXPECT_EQ(full_level("Mono14", frames), 16383);
  EXPECT_EQ(full_level("", std::vector<GreyView>{}), 0);
}

}  // namespace
}  // namespace slsd
