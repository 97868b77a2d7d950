// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/pattern_pitch.hpp"

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

constexpr double kPitchPx = 12;

/// Symbols of 60 columns and 40 rows on a tilted surface.
/// @param noise    of each place, px
/// @param shifted  place of a column plus its displacement, in columns
std::vector<SymbolPlace> symbols(double noise, const std::function<double(int column, int row)>& shifted) {
  std::mt19937 random(3);
  std::normal_distribution<double> gauss(0, noise);
  std::vector<SymbolPlace> symbols;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 60; ++column) {
      const double x = kPitchPx * shifted(column, row);
      symbols.push_back({column, row, x * (1 + 1e-4 * x + 1e-4 * row) + gauss(random)});
    }
  }
  return symbols;
}

/// A scaler that shows each pixel of a symbol of 9 px at the next of fewer pixels.
double scaled(int column) {
  constexpr double kScale = 0.9375, kPixels = 9;
  return std::round(kScale * kPixels * column) / (kScale * kPixels);
}

TEST(MeasurePitch, IsEvenOnASmoothSurface) {
  const auto pitch = measure_pitch(symbols(0.15, [](int column, int) { return column; }));
  ASSERT_TRUE(pitch);
  EXPECT_NEAR(pitch->pitch_px, 13.5, 1);
  EXPECT_LT(pitch->unevenness_px, 0.03);
  EXPECT_FALSE(pitch->is_uneven());
}

TEST(MeasurePitch, SeesAScaler) {
  const auto pitch = measure_pitch(symbols(0.15, [](int column, int) { return scaled(column); }));
  ASSERT_TRUE(pitch);
  EXPECT_TRUE(pitch->is_uneven()) << pitch->unevenness_px;
}

TEST(MeasurePitch, IsTheDeviationOfIndependentColumns) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss(0, 0.2 / kPitchPx);
  std::vector<double> displaced;
  for (int column = 0; column < 60; ++column) displaced.push_back(column + gauss(random));
  const auto pitch = measure_pitch(symbols(0.15, [&](int column, int) { return displaced[column]; }));
  ASSERT_TRUE(pitch);
  EXPECT_NEAR(pitch->unevenness_px, 0.2, 0.06);
}

TEST(MeasurePitch, TakesNoDepthEdgeForAScaler) {
  const auto pitch = measure_pitch(symbols(0.15, [](int column, int row) {
    return column + (column > 10 ? 1.5 : 0) + (column > 30 ? 0.7 : 0) + (row > 20 && column > 45 ? 2 : 0);
  }));
  ASSERT_TRUE(pitch);
  EXPECT_FALSE(pitch->is_uneven()) << pitch->unevenness_px;
}

TEST(MeasurePitch, SaysNothingOfFewSymbols) {
  EXPECT_FALSE(measure_pitch({}));
  auto few = symbols(0.1, [](int column, int) { return column; });
  std::erase_if(few, [](const SymbolPlace& symbol) { return symbol.row >= 8; });
  EXPECT_FALSE(measure_pitch(few));
}

}  // namespace
}  // namespace slsd
