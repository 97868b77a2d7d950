// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/summary.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace slsd {
namespace {

TEST(Student, IsThatOfTables) {
  for (const auto& [degrees, value] : {std::pair(1U, 12.706), std::pair(5U, 2.571), std::pair(11U, 2.201),
                                       std::pair(30U, 2.042), std::pair(120U, 1.980)})
    EXPECT_NEAR(student_975(degrees), value, 0.001) << degrees;
}

TEST(SummarisePlaces, NamesTheWorst) {
  const Summary summary = summarise_places(std::array{0.1, -0.3, 0.2}, 0);
  EXPECT_EQ(summary.places, 3U);
  EXPECT_EQ(summary.worst, -0.3);
  EXPECT_NEAR(summary.mean, 0, 1e-12);
  EXPECT_NEAR(summary.high, 4.303 * std::sqrt(0.07 / 3), 1e-6);
  EXPECT_TRUE(std::isinf(summarise_places(std::array{0.1}, 0).high));
}

TEST(SummarisePlaces, HoldsTheTruthIn95OfHundred) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.02);
  int inside = 0;
  constexpr int kSessions = 4000;
  for (int session = 0; session < kSessions; ++session) {
    std::array<double, 6> values;
    const double artefact = 0.5 * noise(random);  // its expanded uncertainty is 0.02
    for (double& value : values) value = 0.7 + artefact + noise(random);
    const Summary summary = summarise_places(values, 0.02);
    inside += summary.low < 0.7 && 0.7 < summary.high;
  }
  EXPECT_NEAR(100.0 * inside / kSessions, 95.5, 1.5);
}

}  // namespace
}  // namespace slsd
