// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/draw_light.hpp"

#include <gmock/gmock.h>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

// The nearest of the four colours, under the tint.
std::size_t colour_at(const ColourImage& picture, int x, int y) {
  const auto away = [&](const Rgb& colour) {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int difference = picture.at(x, y)[c] - mix({117, 117, 117}, colour, 0.55)[c];
      sum += difference * difference;
    }
    return sum;
  };
  return static_cast<std::size_t>(std::ranges::min_element(kLightColours, {}, away) - kLightColours.begin());
}

TEST(DrawLight, ColoursTilesFromGoodToBad) {
  const Grey8 frame(256, 128, 200);
  const TileLevels good{.dark = 10, .lit = 100, .edge_px = 0.8, .period_px = 20};
  TileLevels clipped = good, room = good, blur = good;
  clipped.clipped_of_lit = 0.2, room.dark = 80, blur.edge_px = 1.8;
  const std::vector<PatternedTile> tiles{{0, 0, good}, {64, 0, clipped}, {128, 0, room}, {192, 0, blur}};
  const ColourImage picture = draw_light(frame.view(), tiles);
  EXPECT_EQ(picture.width(), 3 * 256);
  EXPECT_GT(picture.height(), 128 + 30) << "no legend";
  const std::array<std::array<std::size_t, 4>, 3> expected{{{0, 2, 0, 0}, {0, 0, 3, 0}, {0, 0, 0, 2}}};
  for (int measure = 0; measure < 3; ++measure) {
    for (int tile = 0; tile < 4; ++tile)
      EXPECT_EQ(colour_at(picture, 256 * measure + 64 * tile + 32, 32), expected[measure][tile]) << measure << tile;
  }
  EXPECT_EQ(picture.at(32, 96)[0], picture.at(32, 96)[1]) << "a tile without a pattern is coloured";
}

TEST(DrawLight, ShrinksLargeFrames) {
  const ColourImage picture = draw_light(Grey16(2048, 1536, 900).view(), {});
  EXPECT_EQ(picture.width(), 3 * 1024);
}

}  // namespace
}  // namespace slsd
