// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/sign.hpp"

#include <algorithm>

#include <gmock/gmock.h>

namespace slsd {
namespace {

constexpr ImageSize kProjector{1280, 800};
constexpr Sign kSigns[] = {Sign::kHold, Sign::kTaken, Sign::kAgain};

/// Share of the image that is dark.
double dark_share(const Grey8& image) {
  const auto dark = std::count_if(image.data(), image.data() + image.size(), [](auto level) { return level < 128; });
  return static_cast<double>(dark) / static_cast<double>(image.size());
}

TEST(DrawSign, LeavesTheBoardLit) {
  for (const Sign sign : kSigns) {
    const Grey8 image = draw_sign(sign, kProjector, {640, 400});
    EXPECT_EQ(image.width(), 1280);
    EXPECT_EQ(image.height(), 800);
    EXPECT_GT(dark_share(image), 0.01);
    EXPECT_LT(dark_share(image), 0.1);
  }
}

TEST(DrawSign, DistinguishesThem) {
  EXPECT_NE(draw_sign(Sign::kHold, kProjector, {640, 400}), draw_sign(Sign::kTaken, kProjector, {640, 400}));
  EXPECT_NE(draw_sign(Sign::kAgain, kProjector, {640, 400}), draw_sign(Sign::kTaken, kProjector, {640, 400}));
}

// The board may be half out of the light: the sign is not.
TEST(DrawSign, IsWholeWhereverItIsAskedFor) {
  for (const Sign sign : kSigns) {
    const double whole = dark_share(draw_sign(sign, kProjector, {640, 400}));
    for (const Eigen::Vector2d& place :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(1279, 799), Eigen::Vector2d(-5000, 300)}) {
      EXPECT_NEAR(dark_share(draw_sign(sign, kProjector, place)), whole, 0.003);
    }
  }
}

}  // namespace
}  // namespace slsd
