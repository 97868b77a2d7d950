// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/window_index.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/arrays/letter_source.hpp"

namespace slsd {
namespace {

PackedWindow random_window(LetterSource& source, int letters) {
  PackedWindow window = 0;
  for (int cell = 0; cell < kWindowCells; ++cell)
    window = window << 4 | static_cast<PackedWindow>(source.below(letters));
  return window;
}

PackedWindow with_last(PackedWindow window, int letter) {
  return (window & 0x0FFFFFFFF) | static_cast<PackedWindow>(letter) << 32;
}

RC_GTEST_PROP(WindowIndex, FindsWhatAPlainSearchFinds, ()) {
  const int letters = *rc::gen::inRange(2, 9);
  const int distance = *rc::gen::inRange(1, 10);
  LetterSource source(*rc::gen::arbitrary<std::uint32_t>());
  WindowIndex index(letters, distance);
  std::vector<PackedWindow> windows;
  for (int i = 0; i < 30; ++i) {
    const PackedWindow window = random_window(source, letters);
    const unsigned asked = static_cast<unsigned>(source.below(1 << letters));
    unsigned closer = 0;
    for (int letter = 0; letter < letters; ++letter) {
      const auto is_closer = [&](PackedWindow other) {
        return cells_that_differ(with_last(window, letter), other) < distance;
      };
      if (std::ranges::any_of(windows, is_closer)) closer |= 1U << letter;
    }
    RC_ASSERT(index.closer_with(window, asked) == (closer & asked));
    index.add(window);
    windows.push_back(window);
  }
}

TEST(WindowIndex, ForgetsWhatIsTakenBack) {
  WindowIndex index(4, 3);
  index.add(0x012301230);
  index.add(0x333333333);
  EXPECT_EQ(index.closer_with(0x033333311, 0b1111), 0b1000U);
  EXPECT_EQ(index.closer_with(0x033333333, 0b1111), 0b1111U);
  index.remove_last(0x333333333);
  EXPECT_EQ(index.closer_with(0x033333333, 0b1111), 0U);
  EXPECT_EQ(index.closer_with(0x012301233, 0b1011), 0b1011U);
}

TEST(HalfTurned, ReversesTheCells) {
  EXPECT_EQ(half_turned(0x012345670), 0x076543210U);
  EXPECT_EQ(cells_that_differ(0x012345670, 0x012345670), 0);
  EXPECT_EQ(cells_that_differ(0x012345670, 0x712045670), 2);
}

}  // namespace
}  // namespace slsd
