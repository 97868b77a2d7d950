// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/arrays/array_bounds.hpp"
#include "core/code/code_array.hpp"
#include "tests/core/code/naive_distance.hpp"
#include "tests/core/code/naive_runs.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

Result<CodeArray> array_of(ArrayOptions options) {
  options.method = ArrayMethod::kNoRepeats;
  return make_code_array(options);
}

std::string why_not(const ArrayOptions& options) {
  const auto array = array_of(options);
  return array ? "made" : array.error().message;
}

TEST(NoRepeats, GivesTheSameArrayOnEveryMachine) {
  const auto array = array_of({.rows = 45, .columns = 72, .letters = 6, .row_reach = 40, .column_reach = 10});
  ASSERT_TRUE(array) << array.error().message;
  std::uint64_t hash = 14695981039346656037U;
  for (const std::uint8_t cell : array->cells) hash = (hash ^ cell) * 1099511628211U;
  EXPECT_EQ(hash, 15704586187401524265U);
}

RC_GTEST_PROP(NoRepeats, KeepsDistanceAndReachAskedFor, ()) {
  const ArrayOptions options{.rows = *rc::gen::inRange(3, 20),
                             .columns = *rc::gen::inRange(3, 20),
                             .letters = *rc::gen::inRange(6, 9),
                             .seed = *rc::gen::arbitrary<std::uint32_t>(),
                             .minimum_distance = *rc::gen::inRange(1, 4),
                             .row_reach = *rc::gen::inRange(0, 10),
                             .column_reach = *rc::gen::inRange(1, 10)};
  const auto array = array_of(options);
  RC_ASSERT(array.has_value());
  RC_ASSERT(array->minimum_distance == naive_minimum_distance(*array, false));
  RC_ASSERT(array->minimum_distance >= *options.minimum_distance);
  RC_ASSERT(array->row_reach == naive_row_reach(*array));
  RC_ASSERT(array->column_reach == naive_row_reach(naive_transposed(*array)));
  RC_ASSERT(array->row_reach >= std::min(*options.row_reach, options.columns - 3));
  RC_ASSERT(array->column_reach >= std::min(*options.column_reach, options.rows - 3));
}

TEST(NoRepeats, ReachesAlongRowsAsFarAsItCanAndKeepsTheDistanceOfPlainArrays) {
  const auto plain = make_code_array({.rows = 45, .columns = 72, .letters = 6});
  const auto array = array_of({.rows = 45, .columns = 72, .letters = 6});
  ASSERT_TRUE(plain && array);
  EXPECT_EQ(array->minimum_distance, plain->minimum_distance);
  EXPECT_EQ(array->row_reach, 69);
  EXPECT_GE(array->column_reach, 15);
}

TEST(NoRepeats, ReachesAlongWholeColumnsIfRowsAreLeftOut) {
  const auto array = array_of({.rows = 45, .columns = 72, .letters = 6, .row_reach = 0});
  ASSERT_TRUE(array) << array.error().message;
  EXPECT_EQ(naive_row_reach(naive_transposed(*array)), 42);
  EXPECT_EQ(naive_minimum_distance(*array, false), 3);
}

TEST(NoRepeats, DistinguishesTurnedWindowsToo) {
  const auto array =
      array_of({.rows = 20, .columns = 30, .letters = 6, .minimum_distance = 2, .half_turn_unique = true});
  ASSERT_TRUE(array) << array.error().message;
  EXPECT_GE(naive_minimum_distance(*array, true), 2);
  EXPECT_GE(naive_row_reach(*array), 20);
}

TEST(NoRepeats, TakesAReachBeyondTheLineAsAllOfIt) {
  const auto array = array_of({.rows = 6, .columns = 12, .letters = 8, .row_reach = 512, .column_reach = 512});
  ASSERT_TRUE(array) << array.error().message;
  EXPECT_EQ(array->row_reach, 9);
  EXPECT_EQ(array->column_reach, 3);
}

TEST(NoRepeats, MakesTheSmallestArray) {
  const auto array = array_of({.rows = 3, .columns = 3, .letters = 2});
  ASSERT_TRUE(array) << array.error().message;
  EXPECT_EQ(array->row_reach, 0);
}

TEST(NoRepeats, NamesTheBoundThatForbidsTheReach) {
  EXPECT_THAT(
      why_not({.rows = 45, .columns = 72, .letters = 3, .minimum_distance = 1, .row_reach = 22}),
      HasSubstr("Hamming bound: 23 runs of 5 letters would have to differ in 3, but 3 letters have at most 22"));
  EXPECT_THAT(why_not({.rows = 45, .columns = 240, .letters = 6, .minimum_distance = 1, .row_reach = 216}),
              HasSubstr("Singleton bound: 217 runs of 3"));
  EXPECT_THAT(why_not({.rows = 12, .columns = 12, .letters = 2, .minimum_distance = 1, .column_reach = 5}),
              HasSubstr("smaller row_reach or column_reach"));
}

TEST(NoRepeats, GivesUpASearchThatFindsNothing) {
  const ArrayOptions wide{.rows = 45, .columns = 72, .letters = 5, .minimum_distance = 3, .row_reach = 60};
  EXPECT_THAT(why_not(wide),
              HasSubstr("without a run that recurs within 60 columns and 0 rows, within the search budget"));
  const ArrayOptions dense{.rows = 90, .columns = 144, .letters = 5, .minimum_distance = 3};
  EXPECT_THAT(why_not(dense), HasSubstr("found no 90x144 array of 5 letters with minimum distance 3 within"));
}

TEST(NoRepeats, ReachesNowhereWithTooFewLettersUnlessAskedTo) {
  const ArrayOptions few{.rows = 45, .columns = 72, .letters = 3};
  const auto array = array_of(few);
  ASSERT_TRUE(array) << array.error().message;
  EXPECT_EQ(array->row_reach, naive_row_reach(*array));
  EXPECT_LT(array->row_reach, 10);
  EXPECT_GE(array->minimum_distance, 1);
}

TEST(NoRepeats, NamesTheBoundOfWindows) {
  EXPECT_THAT(why_not({.rows = 45, .columns = 72, .letters = 3, .minimum_distance = 3}), HasSubstr("Singleton bound"));
  EXPECT_THAT(why_not({.rows = 90, .columns = 144, .letters = 2}), HasSubstr("pigeonhole"));
}

TEST(NoRepeats, RefusesReachesThatMeanNothing) {
  EXPECT_THAT(why_not({.row_reach = -1}), HasSubstr("0 to 512"));
  EXPECT_THAT(why_not({.column_reach = 513}), HasSubstr("0 to 512"));
  EXPECT_THAT(why_not({.row_reach = 0, .column_reach = 0}), HasSubstr("constructive"));
  EXPECT_FALSE(ArrayOptions{.row_reach = 10}.validate());
  EXPECT_FALSE((ArrayOptions{.method = ArrayMethod::kPaper, .column_reach = 10}.validate()));
  EXPECT_TRUE((ArrayOptions{.method = ArrayMethod::kNoRepeats, .row_reach = 0}.validate()));
}

// At 2 letters the Hamming bound allows five runs, at 5 and 6 the Singleton bound q^3.
TEST(ForbiddingRunBound, ForbidsTheFirstReachBeyondIt) {
  EXPECT_FALSE(forbidding_run_bound(2, 100, 4));
  EXPECT_TRUE(forbidding_run_bound(2, 100, 5));
  EXPECT_FALSE(forbidding_run_bound(5, 200, 124));
  EXPECT_TRUE(forbidding_run_bound(5, 200, 125));
  EXPECT_FALSE(forbidding_run_bound(2, 9, 100));  // five runs of 5, seven of 3
  EXPECT_TRUE(forbidding_run_bound(2, 10, 100));
}

}  // namespace
}  // namespace slsd
