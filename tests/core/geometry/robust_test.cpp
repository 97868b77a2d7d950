// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/robust.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(MedianInPlace, IsTheMiddleOfFewAndOfMany) {
  EXPECT_EQ(median_of({}), 0);
  EXPECT_EQ(median_of({7}), 7);
  EXPECT_EQ(median_of({7, 1}), 7) << "the upper of two";
  for (const int count : {3, 4, 15, 16, 17, 18, 101}) {
    std::vector<double> values(static_cast<std::size_t>(count));
    std::iota(values.begin(), values.end(), 0);
    std::ranges::reverse(values);
    EXPECT_EQ(median_of(values), count / 2) << count;
  }
}

TEST(MedianInPlace, ComparesTheNumberInAValue) {
  for (const int count : {3, 16, 17, 101}) {
    std::vector<std::pair<int, float>> values;
    for (int i = 0; i < count; ++i) values.emplace_back(-i, static_cast<float>(i));
    EXPECT_EQ(median_in_place(values, [](const auto& value) { return value.second; }), static_cast<float>(count / 2));
  }
}

TEST(UsualOf, IsTheMedianOfAThousandAndNearToThatOfMore) {
  EXPECT_EQ(usual_of(0, [](std::size_t) { return 1.F; }), 0);
  for (const std::size_t count : {1U, 2U, 999U, 1000U, 1001U, 1999U, 2001U, 9129U}) {
    std::size_t asked = 0;
    const auto scattered = [&](std::size_t place) {
      ++asked;
      EXPECT_LT(place, count);
      return static_cast<float>(place * 7919 % count);
    };
    const float middle = static_cast<float>(count / 2);
    EXPECT_NEAR(usual_of(count, scattered), middle, count > 1000 ? 0.05F * static_cast<float>(count) : 0) << count;
    EXPECT_LE(asked, 1000U);
    EXPECT_GE(asked, std::min<std::size_t>(count, 500));
  }
}

}  // namespace
}  // namespace slsd
