// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/hamming_profile.hpp"

#include <gtest/gtest.h>

#include "tests/core/code/naive_distance.hpp"

namespace slsd {
namespace {

CodeArray array_of(int rows, int columns, int letters, ArrayMethod method) {
  const auto array =
      make_code_array({.rows = rows, .columns = columns, .letters = letters, .seed = 1, .method = method});
  EXPECT_TRUE(array);
  return *array;
}

TEST(HammingProfile, CountsThePapersComparisons) {
  // The paper's independent windows: 360 of 45x72, hence 64,620 comparisons; the mean of random words is 9 (1 - 1/3).
  const HammingProfile profile = hamming_profile(array_of(45, 72, 3, ArrayMethod::kPaper), Windows::kAligned);
  EXPECT_EQ(profile.comparisons(), 64620);
  EXPECT_NEAR(profile.mean(), 6.0, 0.05);
  EXPECT_GE(profile.minimum(), 1);
  EXPECT_GT(profile.share_from(3), 0.95);
  EXPECT_LT(profile.share_from(3), 1.0);
  EXPECT_EQ(profile.share_from(0), 1.0);
}

TEST(HammingProfile, AgreesWithTheBruteForceMinimum) {
  const CodeArray array = array_of(45, 72, 5, ArrayMethod::kConstructive);
  const HammingProfile profile = hamming_profile(array, Windows::kOverlapping);
  EXPECT_EQ(profile.comparisons(), 3010 * 3009 / 2);
  EXPECT_EQ(profile.minimum(), minimum_window_distance(array));
  EXPECT_EQ(profile.share_from(3), 1.0);
}

TEST(HammingProfile, AgreesWithPlainLoops) {
  const CodeArray array = array_of(6, 9, 4, ArrayMethod::kConstructive);
  HammingProfile plain;
  for (int i = 0; i < 28; ++i)
    for (int j = i + 1; j < 28; ++j)
      ++plain.pairs[static_cast<std::size_t>(naive_difference(array, i / 7, i % 7, j / 7, j % 7, false))];
  EXPECT_EQ(hamming_profile(array, Windows::kOverlapping).pairs, plain.pairs);
}

}  // namespace
}  // namespace slsd
