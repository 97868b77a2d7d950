// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/window_index.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/letter_source.hpp"

namespace slsd {
namespace {

PackedWindow random_window(LetterSource& source, int letters) {
  PackedWindow window = 0;
  for (int cell = 0; cell < kWindowCells; ++cell)
    window = window << 4 | static_cast<PackedWindow>(source.below(letters));
  return window;
}

RC_GTEST_PROP(WindowIndex, FindsWhatAPlainSearchFinds, ()) {
  const int letters = *rc::gen::inRange(2, 5);
  const int distance = *rc::gen::inRange(1, 6);
  LetterSource source(*rc::gen::arbitrary<std::uint32_t>());
  WindowIndex index(letters, distance);
  std::vector<PackedWindow> windows;
  for (int i = 0; i < 30; ++i) {
    const PackedWindow window = random_window(source, letters);
    const bool closer =
        std::ranges::any_of(windows, [&](PackedWindow other) { return cells_that_differ(window, other) < distance; });
    RC_ASSERT(index.has_closer(window) == closer);
    index.add(window);
    windows.push_back(window);
  }
}

TEST(WindowIndex, ForgetsWhatIsTakenBack) {
  WindowIndex index(4, 3);
  index.add(0x012301230);
  index.add(0x333333333);
  EXPECT_TRUE(index.has_closer(0x333333331));
  index.remove_last(0x333333333);
  EXPECT_FALSE(index.has_closer(0x333333331));
  EXPECT_TRUE(index.has_closer(0x012301233));
}

TEST(HalfTurned, ReversesTheCells) {
  EXPECT_EQ(half_turned(0x012345670), 0x076543210U);
  EXPECT_EQ(cells_that_differ(0x012345670, 0x012345670), 0);
  EXPECT_EQ(cells_that_differ(0x012345670, 0x712045670), 2);
}

}  // namespace
}  // namespace slsd
