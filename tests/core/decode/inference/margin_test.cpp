// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/margin.hpp"

#include <gtest/gtest.h>

#include "core/decode/options.hpp"

namespace slsd {
namespace {

TEST(Margin, IsHigherForFewerWrongCells) {
  EXPECT_NEAR(margin_for(DecodeOptions().wrong_cells_max), 8, 1e-4);
  float before = -1;
  for (const double wrong : {1., 0.1, 0.05, 0.01, 0.005, 0.001, 0.0005}) {
    EXPECT_GT(margin_for(wrong), before) << wrong;
    before = margin_for(wrong);
  }
  EXPECT_EQ(margin_for(1e-9), kMarginMax);
  EXPECT_GE(margin_for(1), 0);
}

TEST(Margin, SaysThatFewerCellsAreWrongTheHigherItIs) {
  for (float margin = 2; margin < kMarginMax; ++margin) EXPECT_GT(wrong_share(margin), 2 * wrong_share(margin + 1));
  EXPECT_LT(wrong_share(0), 0.1);
  EXPECT_LT(wrong_share(8), 2e-4);
}

}  // namespace
}  // namespace slsd
