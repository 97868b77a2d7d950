// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/ticks.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using ::testing::ElementsAre;

TEST(TickStep, IsOneTwoOrFive) {
  EXPECT_DOUBLE_EQ(tick_step(1000, 6), 200);
  EXPECT_DOUBLE_EQ(tick_step(600, 6), 100);
  EXPECT_DOUBLE_EQ(tick_step(0.9, 6), 0.2);
  EXPECT_DOUBLE_EQ(tick_step(29, 6), 5);
}

RC_GTEST_PROP(TickStep, FitsAtMostSoManyIntoTheSpan, ()) {
  const double span = std::pow(10.0, *rc::gen::inRange(-3000, 5000) / 1000.0);
  const int most = *rc::gen::inRange(1, 12);
  const double step = tick_step(span, most);
  RC_ASSERT(span / step <= most * (1 + 1e-9));
  RC_ASSERT(span / step > most / 2.51);
}

TEST(Ticks, AreTheMultiplesWithin) {
  EXPECT_THAT(ticks(-250, 201, 100), ElementsAre(-200, -100, 0, 100, 200));
  EXPECT_THAT(ticks(0.1, 0.3, 0.1), ElementsAre(::testing::DoubleEq(0.1), 0.2, ::testing::DoubleNear(0.3, 1e-12)));
  EXPECT_TRUE(ticks(3, 4, 10).empty());
}

TEST(Ticks, EndFarFromZero) {
  EXPECT_LE(ticks(1e20, 1.0001e20, 1).size(), 1000U);
}

TEST(TickLabel, HasTheDecimalsOfItsStep) {
  EXPECT_EQ(tick_label(1800, 200), "1800");
  EXPECT_EQ(tick_label(0.5, 0.25), "0.5");
  EXPECT_EQ(tick_label(0.05, 0.01), "0.05");
  EXPECT_EQ(tick_label(-0.0, 1), "0");
}

}  // namespace
}  // namespace slsd
