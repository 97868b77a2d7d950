// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/code_array.hpp"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/arrays/paper_array.hpp"
#include "tests/core/code/naive_distance.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

std::uint64_t fnv_hash(const CodeArray& array) {
  std::uint64_t hash = 14695981039346656037U;
  for (const std::uint8_t cell : array.cells) hash = (hash ^ cell) * 1099511628211U;
  return hash;
}

std::string refusal(const ArrayOptions& options) {
  const auto array = make_code_array(options);
  return array ? "made" : array.error().message;
}

TEST(ArrayExtent, RoundsUpToAMultipleOfThree) {
  EXPECT_EQ(array_extent(800, 16, 2), 45);
  EXPECT_EQ(array_extent(1280, 16, 2), 72);
  EXPECT_EQ(array_extent(800, 8, 1), 90);
  EXPECT_EQ(array_extent(1280, 8, 1), 144);
  EXPECT_EQ(array_extent(1080, 16, 2), 60);
  EXPECT_EQ(array_extent(1920, 8, 2), 192);
  EXPECT_EQ(array_extent(810, 16, 2), 45);
  EXPECT_EQ(array_extent(811, 16, 2), 48);
}

TEST(MakeCodeArray, GivesTheSameArrayOnEveryMachine) {
  const auto constructive = make_code_array({.rows = 45, .columns = 72, .letters = 5, .seed = 1});
  const auto paper = make_code_array({.letters = 3, .seed = 1, .method = ArrayMethod::kPaper});
  ASSERT_TRUE(constructive && paper);
  EXPECT_EQ(fnv_hash(*constructive), 4886482064299613085U);
  EXPECT_EQ(fnv_hash(*paper), 15377175698246725128U);
}

TEST(MakeCodeArray, GivesAnotherArrayForAnotherSeed) {
  const auto one = make_code_array({.rows = 12, .columns = 12, .letters = 4, .seed = 1});
  const auto two = make_code_array({.rows = 12, .columns = 12, .letters = 4, .seed = 2});
  ASSERT_TRUE(one && two);
  EXPECT_NE(*one, *two);
}

RC_GTEST_PROP(MakeCodeArray, KeepsTheDistanceAskedFor, ()) {
  const ArrayOptions options{.rows = *rc::gen::inRange(3, 13),
                             .columns = *rc::gen::inRange(3, 13),
                             .letters = *rc::gen::inRange(4, 9),
                             .seed = *rc::gen::arbitrary<std::uint32_t>(),
                             .minimum_distance = *rc::gen::inRange(1, 3),
                             .half_turn_unique = *rc::gen::arbitrary<bool>()};
  const auto array = make_code_array(options);
  RC_ASSERT(array.has_value());
  RC_ASSERT(array->rows == options.rows);
  RC_ASSERT(array->cells.size() == static_cast<std::size_t>(options.rows) * options.columns);
  RC_ASSERT(array->minimum_distance == naive_minimum_distance(*array, options.half_turn_unique));
  RC_ASSERT(array->minimum_distance >= *options.minimum_distance);
}

TEST(MakeCodeArray, DrawsAlignedWindowsThatDifferThePapersWay) {
  const auto array =
      make_code_array({.rows = 45, .columns = 72, .letters = 3, .seed = 5, .method = ArrayMethod::kPaper});
  ASSERT_TRUE(array);
  EXPECT_EQ(array->minimum_distance, 0);
  EXPECT_TRUE(aligned_windows_differ(*array));
  for (int top = 0; top < 45; top += 3)
    for (int left = 0; left < 72; left += 3)
      for (int other = left + 3; other < 72; other += 3)
        EXPECT_GT(naive_difference(*array, top, left, top, other, false), 0);
}

struct Reached {
  int rows, columns, letters, distance, distance_with_turn;  // 0: no array
};

class LargestDistance : public ::testing::TestWithParam<Reached> {};

TEST_P(LargestDistance, IsReachedOrBeaten) {
  const Reached& want = GetParam();
  for (const bool half_turn : {false, true}) {
    const int least = half_turn ? want.distance_with_turn : want.distance;
    if (least == 0) continue;
    const auto array = make_code_array(
        {.rows = want.rows, .columns = want.columns, .letters = want.letters, .half_turn_unique = half_turn});
    ASSERT_TRUE(array) << array.error().message;
    EXPECT_GE(minimum_window_distance(*array, half_turn), least);
  }
}

INSTANTIATE_TEST_SUITE_P(
    DerivedTable, LargestDistance,
    ::testing::Values(
        Reached{45, 72, 3, 1, 1}, Reached{45, 72, 4, 2, 2}, Reached{45, 72, 5, 3, 2}, Reached{45, 72, 6, 3, 3},
        Reached{45, 72, 7, 4, 3}, Reached{45, 72, 8, 4, 4}, Reached{60, 93, 3, 1, 1}, Reached{60, 93, 4, 2, 2},
        Reached{60, 93, 5, 2, 2}, Reached{60, 93, 6, 3, 3}, Reached{60, 93, 7, 3, 3}, Reached{60, 93, 8, 4, 3},
        Reached{81, 129, 3, 1, 0}, Reached{81, 129, 4, 2, 1}, Reached{81, 129, 5, 2, 2}, Reached{81, 129, 6, 3, 2},
        Reached{81, 129, 7, 3, 3}, Reached{81, 129, 8, 3, 3}, Reached{90, 144, 4, 1, 1}, Reached{90, 144, 5, 2, 2},
        Reached{90, 144, 6, 3, 2}, Reached{90, 144, 7, 3, 3}, Reached{90, 144, 8, 3, 3}, Reached{60, 108, 3, 1, 1},
        Reached{60, 108, 4, 2, 1}, Reached{60, 108, 5, 2, 2}, Reached{60, 108, 6, 3, 3}, Reached{60, 108, 7, 3, 3},
        Reached{60, 108, 8, 4, 3}, Reached{108, 192, 4, 1, 1}, Reached{108, 192, 5, 2, 2}, Reached{108, 192, 6, 2, 2},
        Reached{108, 192, 7, 3, 3}, Reached{108, 192, 8, 3, 3}),
    [](const auto& test) {
      const Reached& want = test.param;
      return std::to_string(want.rows) + "x" + std::to_string(want.columns) + "_" + std::to_string(want.letters);
    });

TEST(MakeCodeArray, NamesThePigeonholeBound) {
  const std::string message = refusal({.rows = 90, .columns = 144, .letters = 2});
  EXPECT_THAT(message, HasSubstr("pigeonhole"));
  EXPECT_THAT(message, HasSubstr("12,496 windows"));
  EXPECT_THAT(message, HasSubstr("512 words"));
}

TEST(MakeCodeArray, DoublesThePigeonholeBoundUnderHalfTurn) {
  // 10,033 windows, read both ways up, need 20,066 words of 19,683 less the 243 that are their own turn.
  const std::string message = refusal({.rows = 81, .columns = 129, .letters = 3, .half_turn_unique = true});
  EXPECT_THAT(message, HasSubstr("pigeonhole"));
  EXPECT_THAT(message, HasSubstr("19,440"));
}

TEST(MakeCodeArray, NamesTheSingletonAndTheHammingBound) {
  EXPECT_THAT(refusal({.rows = 45, .columns = 72, .letters = 3, .minimum_distance = 3}), HasSubstr("Singleton bound"));
  EXPECT_THAT(refusal({.rows = 102, .columns = 102, .letters = 4, .minimum_distance = 3}), HasSubstr("Hamming bound"));
}

TEST(MakeCodeArray, SaysWhenOnlyTheSearchFailed) {
  const auto array = make_code_array({.rows = 90, .columns = 144, .letters = 3});
  ASSERT_FALSE(array);
  EXPECT_EQ(array.error().code, ErrorCode::kImpossible);
  EXPECT_THAT(array.error().message, HasSubstr("no bound forbids it"));
}

TEST(MakeCodeArray, NamesTheBoundOfAlignedWindows) {
  EXPECT_THAT(refusal({.rows = 90, .columns = 144, .letters = 2, .method = ArrayMethod::kPaper}),
              HasSubstr("1440 aligned windows"));
}

TEST(ArrayOptions, RefusesWhatIsOutOfRange) {
  EXPECT_FALSE(ArrayOptions{.rows = 2}.validate());
  EXPECT_FALSE(ArrayOptions{.columns = 513}.validate());
  EXPECT_FALSE(ArrayOptions{.letters = 1}.validate());
  EXPECT_FALSE(ArrayOptions{.letters = 9}.validate());
  EXPECT_FALSE(ArrayOptions{.minimum_distance = 0}.validate());
  EXPECT_FALSE(ArrayOptions{.minimum_distance = 10}.validate());
  EXPECT_FALSE((ArrayOptions{.method = ArrayMethod::kPaper, .half_turn_unique = true}.validate()));
  EXPECT_TRUE(ArrayOptions{}.validate());
}

}  // namespace
}  // namespace slsd
