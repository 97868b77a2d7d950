// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/blurred_pattern.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/code/pattern.hpp"

namespace slsd {
namespace {

constexpr int kOpticsDrawn = 100;
constexpr float kPatchScatter = 0.02F;  // of a patch's variance, projector px^2

/// Lenses whose blur differs over the frame and with depth.
struct Optics {
  float even = 0.4F, aside = 0, outward = 0, focus = 0.0005F, defocus = 0;

  [[nodiscard]] float variance(const Eigen::Vector2f& px, float inverse_depth) const {
    const Eigen::Vector2f at = (px - Eigen::Vector2f(800, 600)) / 800;
    const float off = (inverse_depth - focus) / 0.0001F;
    return even + aside * at.x() + outward * at.squaredNorm() + defocus * off * off;
  }
};

/// Patches anywhere, between 1.7 and 2.4 m.
std::vector<BlurSample> blur_samples(const Optics& optics, std::mt19937& random, std::size_t count, float noise,
                                     double outliers = 0) {
  std::uniform_real_distribution<float> u(0, 1600), v(0, 1200), depth(1700, 2400), wrong(0, 2);
  std::normal_distribution<float> gauss(0, 1);
  std::bernoulli_distribution is_wrong(outliers);
  std::vector<BlurSample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    BlurSample& sample = samples.emplace_back(BlurSample{{u(random), v(random)}, 1 / depth(random), 0});
    sample.variance = is_wrong(random)
                          ? wrong(random)
                          : optics.variance(sample.camera_px, sample.inverse_depth) + noise * gauss(random);
  }
  return samples;
}

Optics any_optics(std::mt19937& random) {
  std::uniform_real_distribution<float> share(0, 1);
  return {0.3F + 0.2F * share(random), 0.1F * (share(random) - 0.5F), 0.15F * share(random),
          0.00045F + 0.0001F * share(random), 0.1F * share(random)};
}

const PatternFields& blurred_fields() {
  static const PatternFields made(draw_pattern(make_pattern({}).value()));
  return made;
}

BlurredPattern blurred_by(const std::vector<BlurSample>& samples) {
  return {blurred_fields(), 0.63F, samples};
}

TEST(BlurOverFrame, IsFoundWhereverItDiffers) {
  std::mt19937 random(20261130);
  double squares = 0;
  int count = 0;
  for (int draw = 0; draw < kOpticsDrawn; ++draw) {
    const Optics optics = any_optics(random);
    const BlurOverFrame blur(blur_samples(optics, random, 64, kPatchScatter, 0.1));
    for (const BlurSample& truth : blur_samples(optics, random, 50, 0)) {
      const double off = blur.variance_at(truth.camera_px, truth.inverse_depth) - truth.variance;
      squares += off * off, ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.6 * static_cast<double>(kPatchScatter));
}

TEST(BlurOverFrame, StaysWithinWhatTheSamplesShow) {
  std::mt19937 random(7);
  const auto samples = blur_samples({.outward = 0.2F, .defocus = 0.2F}, random, 64, kPatchScatter);
  const BlurOverFrame blur(samples);
  for (const float depth : {100.F, 500.F, 5000.F, 1e6F}) {
    const float there = blur.variance_at({-4000, 9000}, 1 / depth);
    EXPECT_GE(there, blur.least());
    EXPECT_LE(there, blur.most());
  }
}

TEST(BlurOverFrame, MovesWithTheOriginOfThePixels) {
  std::mt19937 random(8);
  BlurOverFrame blur(blur_samples({.aside = 0.1F, .outward = 0.2F}, random, 64, kPatchScatter));
  const float before = blur.variance_at({400, 300}, 0.0005F);
  blur.move_origin({100, 200});
  EXPECT_FLOAT_EQ(blur.variance_at({300, 100}, 0.0005F), before);
}

TEST(BlurredPattern, HasOneFieldIfTheBlurIsEven) {
  std::mt19937 random(9);
  for (int draw = 0; draw < kOpticsDrawn; ++draw) {
    const BlurredPattern pattern = blurred_by(blur_samples({}, random, 64, kPatchScatter, 0.05));
    ASSERT_EQ(pattern.levels(), 1) << draw;
    EXPECT_EQ(&pattern.field(pattern.level_at({1500, 10}, 0.0006F)), &pattern.usual());
    EXPECT_TRUE(pattern.suits(0, {1500, 10}, 0.0006F));
  }
}

TEST(BlurredPattern, HasAFieldForEachPlace) {
  std::mt19937 random(10);
  const Optics optics{.outward = 0.1F, .defocus = 0.02F};
  const BlurredPattern pattern = blurred_by(blur_samples(optics, random, 200, 0.002F));
  ASSERT_GE(pattern.levels(), 2);
  for (const BlurSample& truth : blur_samples(optics, random, 500, 0)) {
    const auto off_at = [&](int level) {
      return std::abs(pattern.field(level).blur_sigma_px() / std::sqrt(truth.variance) - 1);
    };
    const int nearest = pattern.level_at(truth.camera_px, truth.inverse_depth);
    EXPECT_LT(off_at(nearest), 0.1F);
    for (int level = 0; level < pattern.levels(); ++level) {
      EXPECT_GE(off_at(level) + 0.02F, off_at(nearest));
      if (off_at(level) < 0.05F) {
        EXPECT_TRUE(pattern.suits(level, truth.camera_px, truth.inverse_depth));
      }
      if (off_at(level) > 0.08F) {
        EXPECT_FALSE(pattern.suits(level, truth.camera_px, truth.inverse_depth));
      }
    }
  }
}

TEST(BlurredPattern, FewPatchesTellNoDifference) {
  std::mt19937 random(11);
  const Optics optics{.outward = 0.5F, .defocus = 0.1F};
  EXPECT_EQ(blurred_by(blur_samples(optics, random, 15, 0)).levels(), 1);
  EXPECT_EQ(blurred_by({}).levels(), 1);
  EXPECT_GE(blurred_by(blur_samples(optics, random, 64, 0)).levels(), 2);
}

}  // namespace
}  // namespace slsd
