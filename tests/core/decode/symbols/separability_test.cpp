// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/separability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>

#include "core/code/pattern.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

Separability assess(const std::vector<int>& symbols, const LookOptions& options = {}) {
  const auto separability = assess_separability(symbols, options);
  EXPECT_TRUE(separability);
  return *separability;
}

TEST(AssessSeparability, ComparesEveryPairClosestFirst) {
  const Separability separability = assess({5, 7, 22, 25, 12});
  EXPECT_EQ(separability.pairs.size(), 10U);
  EXPECT_EQ(separability.losses.size(), 5U);
  EXPECT_TRUE(std::ranges::is_sorted(separability.pairs, {}, &SymbolPair::distance));
  EXPECT_EQ(separability.smallest_distance(), separability.pairs.front().distance);
}

TEST(AssessSeparability, GivesTheSameAnswerTwice) {
  EXPECT_EQ(assess({7, 22, 25}).smallest_distance(), assess({7, 22, 25}).smallest_distance());
}

TEST(AssessSeparability, HoldsTheDefaultSymbolsForSafe) {
  for (const int size_px : kSymbolSizesPx) {
    const Separability separability = assess(default_symbols(size_px), {.symbol_size_px = size_px});
    EXPECT_TRUE(separability.risky_pairs().empty()) << size_px << ": " << separability.smallest_distance();
    EXPECT_TRUE(separability.risky_symbols().empty()) << size_px;
  }
}

TEST(AssessSeparability, HoldsThePapersPatternsAndTheExampleForSafe) {
  for (const std::vector<int>& symbols :
       {std::vector<int>{5, 7, 22}, std::vector<int>{25, 7, 22}, std::vector<int>{5, 7, 22, 25, 12}})
    EXPECT_TRUE(assess(symbols).risky_pairs().empty());
}

TEST(AssessSeparability, FindsDiscAndSquareRiskyAtEightPixels) {
  const Separability separability = assess({1, 7, 22}, {.symbol_size_px = 8});
  ASSERT_EQ(separability.risky_pairs().size(), 1U);
  EXPECT_EQ(separability.risky_pairs().front().first, 1);
  EXPECT_EQ(separability.risky_pairs().front().second, 7);
  EXPECT_THAT(separability_warnings(separability, 8).front(), HasSubstr("1 (disc) and 7 (square) look alike at 8 px"));
}

// Along the line on which the two differ most, a boundary is as many standard deviations from one as from the other.
TEST(AssessSeparability, CountsDeviationsToTheBoundaryBetweenTwo) {
  const LookOptions options;
  const auto spreads = spread_of_symbols({.symbols = {5, 12},
                                          .symbol_size_px = options.symbol_size_px,
                                          .spacing_px = options.spacing_px,
                                          .frame_error = static_cast<float>(options.frame_error),
                                          .samples = options.looks,
                                          .blur_px = static_cast<float>(options.blur_px),
                                          .noise = static_cast<float>(options.noise)});
  const auto &one = spreads.at(0), &other = spreads.at(1);
  const FeatureCovariance both = one.covariance + other.covariance;
  const Eigen::VectorXd along = both.fullPivLu().solve(other.mean - one.mean);
  const auto deviation = [&](const SymbolSpread& spread) {
    double variance = 0;
    for (int i = 0; i < along.size(); ++i)
      for (int j = 0; j < along.size(); ++j) variance += along[i] * spread.covariance(i, j) * along[j];
    return std::sqrt(variance);
  };
  const double distance = assess({5, 12}, options).smallest_distance();
  const double boundary = along.dot(one.mean) + distance * deviation(one);
  EXPECT_GT(distance, 3);
  EXPECT_NEAR((along.dot(other.mean) - boundary) / deviation(other), distance, 1e-6 * distance);
}

TEST(AssessSeparability, SeesThatBlurBringsSymbolsTogether) {
  const LookOptions sharp{.symbol_size_px = 8, .spacing_px = 4, .blur_px = 0.6};
  const LookOptions blurred{.symbol_size_px = 8, .spacing_px = 4, .blur_px = 1.8};
  EXPECT_GT(assess({10, 18, 12}, sharp).smallest_distance(), assess({10, 18, 12}, blurred).smallest_distance());
}

TEST(AssessSeparability, SeesThatNeighboursGrowTogether) {
  const LookOptions dense{.symbol_size_px = 8, .spacing_px = 1, .blur_px = 1.5};
  const Separability separability = assess({7, 3}, dense);
  EXPECT_FALSE(separability.risky_symbols().empty());
  EXPECT_THAT(separability_warnings(separability, 8).back(), HasSubstr("merges with"));
}

TEST(AssessSeparability, RefusesWhatIsOutOfRange) {
  EXPECT_FALSE(assess_separability({7}, {}));
  EXPECT_FALSE(assess_separability({7, 7}, {}));
  EXPECT_FALSE(assess_separability({7, 26}, {}));
  EXPECT_FALSE(assess_separability({7, 22}, {.symbol_size_px = 9}));
  EXPECT_FALSE(assess_separability({7, 0}, {}));
  EXPECT_FALSE(assess_separability({7, 22}, {.camera_px_per_projector_px = 0}));
  EXPECT_FALSE(assess_separability({7, 22}, {.camera_px_per_projector_px = 11}));
  EXPECT_FALSE(assess_separability({7, 22}, {.spacing_px = 0}));
  EXPECT_FALSE(assess_separability({7, 22}, {.spacing_px = 17}));
  EXPECT_FALSE(assess_separability({7, 22}, {.blur_px = 21}));
  EXPECT_FALSE(assess_separability({7, 22}, {.looks = 9}));
  EXPECT_FALSE(assess_separability({7, 22}, {.looks = 100001}));
  EXPECT_FALSE(assess_separability({7, 22}, {.blur_px = std::numeric_limits<double>::quiet_NaN()}));
}

TEST(SpreadOfSymbols, MeasuresASquareAsItIs) {
  // A square of side 1 has area 1 and second moments 1/12 and no others.
  const auto spread = spread_of_symbols({.symbols = {7},
                                         .spacing_px = 8,
                                         .camera_px_per_projector_px = 3,
                                         .frame_error = 0,
                                         .blur_px = 0.3F,
                                         .noise = 0.F});
  const auto& mean = spread.at(0).mean;
  EXPECT_EQ(spread[0].lost, 0);
  EXPECT_NEAR(mean(0), 1, 0.05);
  EXPECT_NEAR(mean(1), 1.0 / 12, 0.004);
  EXPECT_NEAR(mean(2), 0, 0.001);
  EXPECT_NEAR(mean(3), 1.0 / 12, 0.004);
  EXPECT_NEAR(mean.tail<4>().cwiseAbs().maxCoeff(), 0, 0.001);
}

TEST(SpreadOfSymbols, TellsWhichWayATrianglePoints) {
  // Mass left and below: x - mean is skewed to the right, y - mean upwards (y is down).
  const auto spread = spread_of_symbols({.symbols = {25}});
  EXPECT_GT(spread.at(0).mean(4), 0.001);
  EXPECT_LT(spread.at(0).mean(7), -0.001);
}

}  // namespace
}  // namespace slsd
