// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/focus_chart.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>

#include "picture/pixel_digits.hpp"

namespace slsd {
namespace {

constexpr std::pair<int, int> kSizes[] = {{1, 1}, {64, 64}, {640, 360}, {641, 363}, {1280, 800}, {3840, 2160}};

TEST(DrawFocusChart, LightsTheOutermostPixels) {
  for (const auto& [width, height] : kSizes) {
    const Grey8 chart = draw_focus_chart(width, height);
    ASSERT_EQ(std::pair(chart.width(), chart.height()), std::pair(width, height));
    for (int x = 0; x < width; ++x) EXPECT_EQ(std::min(chart.at(x, 0), chart.at(x, height - 1)), 255);
    for (int y = 0; y < height; ++y) EXPECT_EQ(std::min(chart.at(0, y), chart.at(width - 1, y)), 255);
  }
}

TEST(DrawFocusChart, IsBlackAndWhiteAndMostlyBlack) {
  for (const auto& [width, height] : kSizes) {
    const Grey8 chart = draw_focus_chart(width, height);
    const auto lit = std::count(chart.data(), chart.data() + chart.size(), 255);
    const auto dark = std::count(chart.data(), chart.data() + chart.size(), 0);
    EXPECT_EQ(static_cast<std::size_t>(lit + dark), chart.size());
    if (width >= 640) {
      EXPECT_LT(lit, 0.15 * static_cast<double>(chart.size()));
    }
  }
}

// The cross goes through the exact centre: turned by half a turn it is where it was.
TEST(DrawFocusChart, HasItsCrossInTheCentre) {
  for (const auto& [width, height] : {std::pair(640, 360), std::pair(641, 363)}) {
    const Grey8 chart = draw_focus_chart(width, height);
    const int y = height / 20 + 2;  // below the inner frame, above the stars
    for (int x = 0; x < width; ++x) EXPECT_EQ(chart.at(x, y), chart.at(width - 1 - x, height - 1 - y)) << x;
    EXPECT_EQ(chart.at((width - 1) / 2, y), 255);
    EXPECT_EQ(chart.at(width / 2, y), 255);
  }
}

TEST(DrawFocusChart, HasStarsInTheCentreAndTheCorners) {
  const int radius = 800 / 14, margin = 800 / 20 + 4 + radius;
  const Grey8 chart = draw_focus_chart(1280, 800);
  for (const auto& [x, y] : {std::pair(640, 400), std::pair(margin, margin), std::pair(1279 - margin, margin),
                             std::pair(margin, 799 - margin), std::pair(1279 - margin, 799 - margin)}) {
    int edges = 0;
    for (int i = 0; i < 3600; ++i) {
      const auto at = [&, x = x, y = y](int step) {
        const double angle = 2 * std::numbers::pi * step / 3600;
        return chart.at(x + static_cast<int>(std::lround(0.8 * radius * std::cos(angle))),
                        y + static_cast<int>(std::lround(0.8 * radius * std::sin(angle))));
      };
      edges += at(i) != at(i + 1) ? 1 : 0;
    }
    EXPECT_GE(edges, 36);  // a pixel on an edge may be passed to and fro
    EXPECT_LT(edges, 60);
  }
}

TEST(DrawFocusChart, HasLinesOfOneAndOfTwoPixels) {
  const Grey8 chart = draw_focus_chart(1280, 800);
  const int radius = 800 / 14, block = radius - 2;
  const int left = 640 + radius + 4, top = 400 - radius;
  for (int i = 0; i + 2 < block; ++i) {
    EXPECT_NE(chart.at(left + i, top + 5), chart.at(left + i + 1, top + 5));
    EXPECT_NE(chart.at(left + block + 4 + 5, top + i), chart.at(left + block + 4 + 5, top + i + 1));
    EXPECT_NE(chart.at(left + i, top + block + 4 + 5), chart.at(left + i + 2, top + block + 4 + 5));
  }
}

TEST(DrawPixelDigits, WritesSquares) {
  Grey8 image(14, 6);
  draw_pixel_digits(image, 1, 0, 1, "4x2");
  const char* expected[] = {".#.#.....###..", ".#.#.#.#...#..", ".###..#..###..",
                            "...#.#.#.#....", "...#.....###..", ".............."};
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 14; ++x) EXPECT_EQ(image.at(x, y) == 255, expected[y][x] == '#') << x << " " << y;
  }
  EXPECT_EQ(pixel_digits_width(1, "4x2"), 11);
}

TEST(DrawPixelDigits, CutsWhatLiesOutside) {
  Grey8 image(4, 4);
  draw_pixel_digits(image, -2, -3, 3, "88 8");
  EXPECT_EQ(image.at(0, 0), 255);
}

}  // namespace
}  // namespace slsd
