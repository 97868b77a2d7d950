// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/pattern_field.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "core/clones.hpp"
#include "tests/core/appearance/plain_light.hpp"

namespace slsd {
namespace {

using test::plain_light;

Grey8 blocks() {
  Grey8 pattern(40, 30);
  for (int y = 6; y < 22; ++y)
    for (int x = 8; x < 24; ++x) pattern.at(x, y) = (x + y) % 11 < 7 ? 255 : 0;
  return pattern;
}

double anywhere(int low, int high) {
  return *rc::gen::inRange(1000 * low, 1000 * high) / 1000.0;
}

RC_GTEST_PROP(PatternField, IsTheBlurredPatternToOnePercent, ()) {
  const Grey8 pattern = blocks();
  const float sigma = static_cast<float>(anywhere(0, 1)) + 0.5F;
  const PatternField field(pattern.view(), sigma);
  const double u = anywhere(-5, 44), v = anywhere(-5, 34);
  const auto sample = field.at(static_cast<float>(u), static_cast<float>(v));
  // The nearest sample is at most a quarter of a pixel away along each axis; what its slopes leave out is second order.
  const double left_out = 0.5 * 0.0625 * 2 * 0.242 / (sigma * sigma) + 0.002;
  RC_ASSERT(std::abs(sample.value - plain_light(pattern, sigma, u, v)) < left_out);
}

RC_GTEST_PROP(PatternField, SlopesAreThoseOfItsSamples, ()) {
  const Grey8 pattern = blocks();
  const PatternField field(pattern.view(), 0.8F);
  const double u = 0.5 * *rc::gen::inRange(0, 78), v = 0.5 * *rc::gen::inRange(0, 58);
  const auto sample = field.at(static_cast<float>(u), static_cast<float>(v));
  constexpr double kStep = 1e-3;
  const auto light = [&](double x, double y) { return plain_light(pattern, 0.8, x, y); };
  RC_ASSERT(std::abs(sample.slope_u - (light(u + kStep, v) - light(u - kStep, v)) / (2 * kStep)) < 2e-3);
  RC_ASSERT(std::abs(sample.slope_v - (light(u, v + kStep) - light(u, v - kStep)) / (2 * kStep)) < 2e-3);
}

TEST(PatternFields, FindsTheNearestBlur) {
  const PatternFields fields(blocks());
  EXPECT_EQ(fields.nearest(0).blur_sigma_px(), PatternFields::kLadderPx.front());
  EXPECT_EQ(fields.nearest(9).blur_sigma_px(), PatternFields::kLadderPx.back());
  EXPECT_EQ(fields.nearest(0.8F).blur_sigma_px(), 0.72F);
  EXPECT_EQ(fields.nearest(0.9F).blur_sigma_px(), 0.95F);
  EXPECT_EQ(&fields.nearest(0.9F), &fields.rung(3)) << "made once";
}

TEST(PatternField, IsTheSameInEveryClone) {
  const Grey8 pattern = blocks();
  const Clone usual = clone_in_use.exchange(Clone::kPlain);
  const PatternField plain(pattern.view(), 0.6F);
  for (const Clone clone : clones_here()) {
    clone_in_use = clone;
    const PatternField field(pattern.view(), 0.6F);
    const std::size_t count = static_cast<std::size_t>(field.width()) * field.height();
    EXPECT_TRUE(std::equal(field.samples(), field.samples() + count, plain.samples())) << static_cast<int>(clone);
  }
  clone_in_use = usual;
}

TEST(PatternField, IsDarkFarOutside) {
  Grey8 lit(20, 20, 255);
  const PatternField field(lit.view(), 1.F);
  EXPECT_NEAR(field.at(10, 10).value, 1, 1e-3);
  EXPECT_NEAR(field.at(-0.5, 10).value, 0.5, 2e-3);
  for (const float far : {-6.F, -1000.F, 1000.F}) EXPECT_NEAR(field.at(far, 10).value, 0, 1e-3) << far;
}

}  // namespace
}  // namespace slsd
