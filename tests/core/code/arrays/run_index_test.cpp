// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/run_index.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/arrays/letter_source.hpp"

namespace slsd {
namespace {

/// Tells whether three of the last letters, at most five, equal those of an earlier run of the line. Slow and plain.
bool naive_ends_recurring_run(const std::vector<int>& line, int reach) {
  const int end = static_cast<int>(line.size());
  for (int apart = 1; apart <= reach; ++apart) {
    int equal = 0;
    for (int back = 1; back <= 5 && end - back - apart >= 0; ++back)
      equal += line[static_cast<std::size_t>(end - back)] == line[static_cast<std::size_t>(end - back - apart)];
    if (equal >= 3) return true;
  }
  return false;
}

unsigned naive_ending(std::vector<int> line, int letters, int reach) {
  unsigned ending = 0;
  line.push_back(0);
  for (line.back() = 0; line.back() < letters; ++line.back())
    if (naive_ends_recurring_run(line, reach)) ending |= 1U << line.back();
  return ending;
}

// Lines of two lengths, below and above the 64 places that one operation compares.
RC_GTEST_PROP(RunIndex, FindsWhatAPlainSearchFinds, ()) {
  const int letters = *rc::gen::inRange(2, 9);
  const int cells = *rc::gen::elementOf(std::vector{12, 150});
  const int reach = *rc::gen::inRange(0, cells + 1);
  LetterSource source(*rc::gen::arbitrary<std::uint32_t>());
  RunIndex index(2, cells, letters, reach);
  std::vector<int> line;
  for (int place = 0; place < cells; ++place) {
    const unsigned ending = naive_ending(line, letters, reach);
    RC_ASSERT(index.ending_recurring_run(1, place) == ending);
    int letter = source.below(letters);
    for (int tries = 0; tries < letters && (ending >> letter & 1U) != 0; ++tries) letter = (letter + 1) % letters;
    if ((ending >> letter & 1U) != 0) return;  // as in an array, no run of the line recurs
    index.add(1, place, letter);
    line.push_back(letter);
  }
}

TEST(RunIndex, ForgetsWhatIsTakenBack) {
  RunIndex index(1, 9, 3, 6);
  for (int place = 0; place < 5; ++place) index.add(0, place, place % 3);
  EXPECT_EQ(index.ending_recurring_run(0, 5), 0b100U);
  index.remove_last(0, 4, 1);
  index.add(0, 4, 2);
  EXPECT_EQ(index.ending_recurring_run(0, 5), 0U);
}

TEST(RunIndex, KeepsLinesApart) {
  RunIndex index(2, 9, 3, 6);
  for (int place = 0; place < 5; ++place) index.add(0, place, place % 3);
  EXPECT_EQ(index.ending_recurring_run(0, 5), 0b100U);
  EXPECT_EQ(index.ending_recurring_run(1, 5), 0U);
}

}  // namespace
}  // namespace slsd
