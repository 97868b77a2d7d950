// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/core/code/naive_distance.hpp"
#include "tests/core/code/random_array.hpp"

namespace slsd {
namespace {

RC_GTEST_PROP(MinimumWindowDistance, AgreesWithSixPlainLoops, ()) {
  const CodeArray array = random_array(*rc::gen::inRange(3, 9), *rc::gen::inRange(3, 9), *rc::gen::inRange(2, 9),
                                       *rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(minimum_window_distance(array) == naive_minimum_distance(array, false));
  RC_ASSERT(minimum_window_distance(array, true) == naive_minimum_distance(array, true));
}

TEST(MinimumWindowDistance, FindsARepeatedWindow) {
  CodeArray array = random_array(30, 30, 8, 3);
  ASSERT_GT(minimum_window_distance(array), 0);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      array.cells[static_cast<std::size_t>((20 + row) * 30 + 17 + column)] =
          static_cast<std::uint8_t>(array.at(2 + row, 5 + column));
  EXPECT_EQ(minimum_window_distance(array), 0);
}

TEST(MinimumWindowDistance, FindsAWindowThatIsItsOwnTurn) {
  const CodeArray array{3, 3, 2, {0, 1, 0, 1, 1, 1, 0, 1, 0}};
  EXPECT_EQ(minimum_window_distance(array), 9);
  EXPECT_EQ(minimum_window_distance(array, true), 0);
}

}  // namespace
}  // namespace slsd
