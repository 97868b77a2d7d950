// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/shade_points.hpp"

#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

CloudPoint seen_at(float u, float v, std::uint8_t intensity = 100) {
  CloudPoint point;
  point.camera_u = u;
  point.camera_v = v;
  point.intensity = intensity;
  return point;
}

/// 8x6 pixels, 10 x + y of the unit.
template <class T>
Image<T> slope(int unit) {
  Image<T> image(8, 6);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) image.at(x, y) = static_cast<T>(unit * (10 * x + y));
  }
  return image;
}

TEST(ShadePoints, TakesTheWhiteFrameBetweenItsPixels) {
  const Grey8 white = slope<std::uint8_t>(1);
  std::vector<CloudPoint> points{seen_at(3, 2), seen_at(3.5F, 2), seen_at(3, 2.5F), seen_at(3.25F, 4)};
  EXPECT_EQ(shade_points(points, {white.view(), std::nullopt, 255}), 0U);
  EXPECT_EQ(points[0].intensity, 32);
  EXPECT_EQ(points[1].intensity, 37);
  EXPECT_EQ(points[2].intensity, 33);  // 32.5
  EXPECT_EQ(points[3].intensity, 37);  // 36.5
}

TEST(ShadePoints, SubtractsTheLightOfTheRoom) {
  const Grey8 white = slope<std::uint8_t>(2), dark = slope<std::uint8_t>(1), bright(8, 6, 200);
  std::vector<CloudPoint> points{seen_at(3, 2)};
  shade_points(points, {white.view(), dark.view(), 255});
  EXPECT_EQ(points[0].intensity, 32);
  shade_points(points, {white.view(), bright.view(), 255});
  EXPECT_EQ(points[0].intensity, 0);
}

TEST(ShadePoints, TakesColoursBetweenPixelsLessThoseOfTheRoomTimesTheGains) {
  const Grey8 white = slope<std::uint8_t>(1);
  ColourFrame colours(8, 6), room(8, 6, {5, 0, 10});
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x)
      colours.at(x, y) = {static_cast<std::uint16_t>(20 * x), static_cast<std::uint16_t>(20 * y), 200};
  std::vector<CloudPoint> points{seen_at(3, 2), seen_at(3.5F, 2.25F)};
  SceneLight light{.white = white.view(), .white_colours = &colours};
  shade_points(points, light);
  EXPECT_EQ(points[0].colour, (Rgb{60, 40, 200}));
  EXPECT_EQ(points[1].colour, (Rgb{70, 45, 200}));
  light.dark_colours = &room, light.gains = {1, 2, 1.5};
  shade_points(points, light);
  EXPECT_EQ(points[0].colour, (Rgb{55, 80, 255}));
  light.colour_full = 1023;
  shade_points(points, light);
  EXPECT_EQ(points[0].colour, (Rgb{14, 20, 71}));
}

// Green alone is saturated, as white light makes it first; the grey does not show it.
TEST(ShadePoints, MakesAPointWhiteAndCountsItIfOneColourIsSaturated) {
  const Grey8 white(8, 6, 180);
  ColourFrame colours(8, 6, {100, 200, 120});
  colours.at(4, 3) = {110, 254, 130};
  std::vector<CloudPoint> points{seen_at(3, 1), seen_at(4, 3), seen_at(3.5F, 2.5F)};
  EXPECT_EQ(shade_points(points, {.white = white.view(), .white_colours = &colours, .gains = {0.5, 0.5, 0.5}}), 2U);
  EXPECT_EQ(points[0].colour, (Rgb{50, 100, 60}));
  EXPECT_EQ(points[1].colour, (Rgb{255, 255, 255}));
  EXPECT_EQ(points[2].colour, (Rgb{255, 255, 255}));
  EXPECT_EQ(points[1].intensity, 180);
}

TEST(ShadePoints, TakesTheIntensityAsColourOfACameraWithoutColours) {
  const Grey8 white = slope<std::uint8_t>(1);
  std::vector<CloudPoint> points{seen_at(3, 2)};
  shade_points(points, {white.view(), std::nullopt, 255});
  EXPECT_EQ(points[0].colour, (Rgb{32, 32, 32}));
}

TEST(ShadePoints, SubtractsItFromTheSymbolsWithoutAWhiteFrame) {
  const Grey8 dark = slope<std::uint8_t>(1);
  std::vector<CloudPoint> points{seen_at(3, 2, 100), seen_at(3, 2, 10)};
  EXPECT_EQ(shade_points(points, {std::nullopt, dark.view(), 255}), 0U);
  EXPECT_EQ(points[0].intensity, 68);
  EXPECT_EQ(points[1].intensity, 0);
}

TEST(ShadePoints, MasksAndCountsWhatIsSaturated) {
  Grey8 white(8, 6, 60);
  const Grey8 dark(8, 6, 250);
  white.at(4, 3) = 255;
  std::vector<CloudPoint> points{seen_at(3.1F, 2.1F), seen_at(4, 3), seen_at(4.9F, 3.9F), seen_at(5.1F, 3),
                                 seen_at(1, 1)};
  EXPECT_EQ(shade_points(points, {white.view(), std::nullopt, 255}), 3U);
  EXPECT_EQ(points[0].intensity, 255);
  EXPECT_EQ(points[1].intensity, 255);
  EXPECT_EQ(points[2].intensity, 255);
  EXPECT_EQ(points[3].intensity, 60);
  EXPECT_EQ(points[4].intensity, 60);
  shade_points(points, {white.view(), dark.view(), 255});
  EXPECT_EQ(points[1].intensity, 255);
  EXPECT_EQ(points[4].intensity, 0);
}

TEST(ShadePoints, ScalesToTheLevelOfSaturation) {
  const Grey16 white = slope<std::uint16_t>(40);
  std::vector<CloudPoint> points{seen_at(5, 1)};
  EXPECT_EQ(shade_points(points, {white.view(), std::nullopt, 4095}), 0U);
  EXPECT_EQ(points[0].intensity, 127);  // 2040 of 4095
  EXPECT_EQ(shade_points(points, {white.view(), std::nullopt, 1023}), 1U);
}

TEST(ShadePoints, StaysWithinTheFrame) {
  const Grey8 white = slope<std::uint8_t>(1);
  std::vector<CloudPoint> points{seen_at(-0.4F, -0.4F), seen_at(7.4F, 5.4F)};
  EXPECT_EQ(shade_points(points, {white.view(), std::nullopt, 255}), 0U);
  EXPECT_EQ(points[0].intensity, 0);
  EXPECT_EQ(points[1].intensity, 75);
}

CloudPoint of_colour(const Rgb& colour) {
  CloudPoint point;
  point.colour = colour;
  return point;
}

TEST(WhiteBalance, MakesTheMeanOfUnsaturatedPointsGrey) {
  const std::vector<CloudPoint> points{of_colour({40, 100, 20}), of_colour({60, 100, 30}), of_colour({255, 1, 1})};
  EXPECT_EQ(white_balance_of(points, {1, 1, 1}), (ColourGains{2, 1, 4}));
  EXPECT_EQ(white_balance_of(points, {2, 1, 1}), (ColourGains{4, 1, 4})) << "the colours had this gain already";
}

TEST(WhiteBalance, IsUnknownIfTheMeanLacksAColour) {
  EXPECT_FALSE(white_balance_of({}, {1, 1, 1}));
  EXPECT_FALSE(white_balance_of(std::vector{of_colour({40, 100, 0})}, {1, 1, 1}));
  EXPECT_FALSE(white_balance_of(std::vector{of_colour({255, 255, 255})}, {1, 1, 1}));
}

}  // namespace
}  // namespace slsd
