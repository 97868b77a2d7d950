// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/letter_source.hpp"

#include <array>

#include <gtest/gtest.h>

namespace slsd {
namespace {

TEST(LetterSource, FollowsTheMersenneTwister) {
  // The first numbers of MT19937 seeded with 1 are 1791095845, 4282876139, 3093770124, 4005303368, 491263.
  LetterSource source(1);
  EXPECT_EQ(source.below(1000), 845);
  EXPECT_EQ(source.below(1000), 139);
  EXPECT_EQ(source.below(1000), 124);
  EXPECT_EQ(source.below(1000), 368);
  EXPECT_EQ(source.below(1000), 263);
}

TEST(LetterSource, DrawsEachLetterAsOften) {
  LetterSource source(7);
  std::array<int, 7> counts{};
  for (int i = 0; i < 70000; ++i) ++counts[static_cast<std::size_t>(source.below(7))];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 400);
}

}  // namespace
}  // namespace slsd
