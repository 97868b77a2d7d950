// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/runs.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/core/code/naive_runs.hpp"
#include "tests/core/code/random_array.hpp"

namespace slsd {
namespace {

CodeArray row_of(const std::string& letters) {
  CodeArray array{1, static_cast<int>(letters.size()), 8, {}};
  for (const char letter : letters) array.cells.push_back(static_cast<std::uint8_t>(letter - '0'));
  return array;
}

double naive_share(const CodeArray& array, int length, int within) {
  int recurring = 0, runs = 0;
  for (int row = 0; row < array.rows; ++row) {
    for (int first = 0; first + length <= array.columns; ++first, ++runs) {
      bool recurs = false;
      for (int other = 0; other + length <= array.columns; ++other)
        recurs = recurs || (other != first && std::abs(other - first) <= within &&
                            naive_run_difference(array, row, first, other, length) < length - 2);
      recurring += recurs ? 1 : 0;
    }
  }
  return static_cast<double>(recurring) / runs;
}

RC_GTEST_PROP(RepeatFreeReach, AgreesWithPlainLoops, ()) {
  const CodeArray array = random_array(*rc::gen::inRange(3, 9), *rc::gen::inRange(3, 40), *rc::gen::inRange(2, 9),
                                       *rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(repeat_free_reach(array, Along::kRows) == naive_row_reach(array));
  RC_ASSERT(repeat_free_reach(array, Along::kColumns) == naive_row_reach(naive_transposed(array)));
}

RC_GTEST_PROP(RecurringShare, AgreesWithPlainLoops, ()) {
  const CodeArray array = random_array(*rc::gen::inRange(3, 9), *rc::gen::inRange(5, 40), *rc::gen::inRange(2, 9),
                                       *rc::gen::arbitrary<std::uint32_t>());
  const int length = *rc::gen::inRange(3, 6), within = *rc::gen::inRange(1, 45);
  RC_ASSERT(recurring_share(array, Along::kRows, length, within) == naive_share(array, length, within));
}

TEST(NearestRecurrence, CountsLettersFromRunToRun) {
  const CodeArray equal = row_of("01234567012");
  EXPECT_EQ(nearest_recurrence(equal, Along::kRows, 3), 8);
  EXPECT_FALSE(nearest_recurrence(equal, Along::kRows, 4));
  EXPECT_EQ(repeat_free_reach(equal, Along::kRows), 7);
}

TEST(NearestRecurrence, AllowsOneOtherLetterInFourAndTwoInFive) {
  const CodeArray one_of_four = row_of("012345670172");
  EXPECT_FALSE(nearest_recurrence(one_of_four, Along::kRows, 4));
  EXPECT_EQ(nearest_recurrence(row_of("012345670163"), Along::kRows, 4), 8);
  EXPECT_FALSE(nearest_recurrence(row_of("012345670163"), Along::kRows, 3));
  EXPECT_EQ(nearest_recurrence(row_of("0123456707253"), Along::kRows, 5), std::nullopt);
  EXPECT_EQ(nearest_recurrence(row_of("0123456707254"), Along::kRows, 5), 8);
  EXPECT_EQ(repeat_free_reach(row_of("0123456707254"), Along::kRows), 7);
}

TEST(NearestRecurrence, LooksAlongColumnsToo) {
  const CodeArray column = naive_transposed(row_of("01234567012"));
  EXPECT_EQ(nearest_recurrence(column, Along::kColumns, 3), 8);
  EXPECT_FALSE(nearest_recurrence(column, Along::kRows, 3));
}

TEST(RepeatFreeReach, IsTheWholeLineIfNothingRecurs) {
  EXPECT_EQ(repeat_free_reach(row_of("01234567"), Along::kRows), 5);
}

TEST(RecurringShare, CountsBothPlacesWithinReach) {
  const CodeArray array = row_of("01234567012");  // nine runs of 3, of which the first and the last are equal
  EXPECT_DOUBLE_EQ(recurring_share(array, Along::kRows, 3, 8), 2. / 9);
  EXPECT_DOUBLE_EQ(recurring_share(array, Along::kRows, 3, 7), 0);
}

}  // namespace
}  // namespace slsd
