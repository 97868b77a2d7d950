// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/canvas.hpp"

#include <gtest/gtest.h>

namespace slsd {
namespace {

constexpr Rgb kRed{255, 0, 0};

int drawn(const ColourImage& picture) {
  int count = 0;
  for (std::size_t i = 0; i < picture.size(); ++i) count += picture.data()[i] != Rgb{} ? 1 : 0;
  return count;
}

// Mean row of what is drawn, weighted by its red.
double middle_row(const ColourImage& picture) {
  double sum = 0, weight = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      sum += y * picture.at(x, y)[0];
      weight += picture.at(x, y)[0];
    }
  }
  return sum / weight;
}

TEST(Canvas, DrawsOnSubPixelPlaces) {
  ColourImage low(9, 9), high(9, 9);
  Canvas(low).disc({4.0, 4.25}, 2.0, kRed);
  Canvas(high).disc({4.0, 3.75}, 2.0, kRed);
  EXPECT_NEAR(middle_row(low), 4.25, 0.1);
  EXPECT_NEAR(middle_row(high), 3.75, 0.1);
}

TEST(Canvas, LeavesGapsBetweenDashes) {
  ColourImage solid(100, 5), dashed(100, 5);
  Canvas(solid).line({0, 2}, {99, 2}, kRed);
  Canvas(dashed).dashes({0, 2}, {99, 2}, kRed, 1, 8);
  EXPECT_LT(drawn(dashed), drawn(solid) * 3 / 4);
  EXPECT_GT(drawn(dashed), drawn(solid) / 3);
}

TEST(Canvas, CutsWhatLiesOutside) {
  ColourImage picture(10, 10);
  Canvas canvas(picture);
  canvas.line({-1e12, 5}, {1e12, 5}, kRed);
  canvas.text({-50, -50}, "far away", 10, kRed);
  canvas.disc({1e9, 1e9}, 5, kRed);
  canvas.rectangle(-5, 8, 40, 40, kRed);
  EXPECT_GT(picture.at(5, 5)[0], 200);
  EXPECT_EQ(picture.at(5, 9), kRed);
  EXPECT_EQ(picture.at(5, 2), Rgb{});
}

TEST(Canvas, AlignsText) {
  for (const auto& [align, first, last] : {std::tuple{Align::kLeft, 100, 160}, {Align::kRight, 40, 100}}) {
    ColourImage picture(200, 30);
    Canvas(picture).text({100, 20}, "12345", 12, kRed, align);
    for (int x = 0; x < 200; ++x) {
      const bool within = x >= first - 2 && x <= last + 2;
      for (int y = 0; y < 30; ++y) EXPECT_TRUE(within || picture.at(x, y) == Rgb{}) << x;
    }
    EXPECT_GT(drawn(picture), 50);
  }
}

TEST(Canvas, WritesAQuestionMarkForWhatItCannotDraw) {
  ColourImage umlaut(100, 30), question(100, 30);
  Canvas(umlaut).text({5, 20}, "\xc3\xa4", 12, kRed);
  Canvas(question).text({5, 20}, "??", 12, kRed);
  EXPECT_EQ(umlaut, question);
}

TEST(Mix, GoesFromOneColourToTheOther) {
  EXPECT_EQ(mix({0, 100, 200}, {100, 0, 200}, 0), (Rgb{0, 100, 200}));
  EXPECT_EQ(mix({0, 100, 200}, {100, 0, 200}, 0.5), (Rgb{50, 50, 200}));
  EXPECT_EQ(mix({0, 100, 200}, {100, 0, 200}, 7), (Rgb{100, 0, 200}));
}

}  // namespace
}  // namespace slsd
