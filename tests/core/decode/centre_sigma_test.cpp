// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centre_sigma.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace slsd {
namespace {

GreyMoments moments_of(float weight, float noise, float contrast) {
  GreyMoments moments;
  moments.weight = weight, moments.noise = noise;
  moments.background = 20, moments.peak = 20 + contrast;
  return moments;
}

TEST(CentreSigma, WithoutNoiseIsWhatNoiseDoesNotExplain) {
  EXPECT_NEAR(centre_sigma_px(moments_of(150, 0, 100)), 0.015, 1e-9);
}

TEST(CentreSigma, FollowsNoiseOverContrast) {
  const double expected = std::hypot(6 / 45. / std::sqrt(12), 0.015);
  EXPECT_NEAR(centre_sigma_px(moments_of(144, 6, 100)), expected, 1e-6);
  EXPECT_NEAR(centre_sigma_px(moments_of(144, 12, 200)), expected, 1e-6);
}

TEST(CentreSigma, IsSmallerForLargerSymbols) {
  EXPECT_LT(centre_sigma_px(moments_of(600, 5, 100)), centre_sigma_px(moments_of(100, 5, 100)));
}

}  // namespace
}  // namespace slsd
