// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_light.hpp"

#include <numbers>

#include <gmock/gmock.h>

#include "tests/core/exposure/seen_by_camera.hpp"

namespace slsd {
namespace {

using ::testing::DoubleNear;
using ::testing::Optional;

FrameLight light_of(const SimulatedCamera& camera, const Grey8& scene) {
  const Grey8 first = seen_by(camera, scene, 1), second = seen_by(camera, scene, 2);
  return measure_frame_light(first.view(), second.view(), 255);
}

TEST(NoiseBetween, MeasuresEachLevel) {
  const SimulatedCamera camera{.photons = 0.06, .sensor = 1};
  const FrameLight light = light_of(camera, exposed(corpus_frame("16px-5-plane_30"), 1.2));
  ASSERT_GT(light.between.levels.size(), 8);
  for (const LevelNoise& at : light.between.levels) {
    if (at.level < 10) continue;  // levels below zero are cut off
    EXPECT_NEAR(at.variance, 1 + 0.06 * at.level, 0.12 * (1 + 0.06 * at.level)) << at.level;
    EXPECT_NEAR(light.noise_at(at.level), std::sqrt(1 + 0.06 * at.level), 0.2) << at.level;
  }
  EXPECT_THAT(light.between.neighbours, Optional(DoubleNear(0, 0.03)));
}

TEST(NoiseBetween, SeesGrain) {
  const Grey8 scene = corpus_frame("16px-5-plane_30");
  // Squares of 3 x 3 and 5 x 5 overlap with their neighbours by two thirds and four fifths.
  EXPECT_THAT(light_of({.grain = 1}, scene).between.neighbours, Optional(DoubleNear(0.67, 0.05)));
  EXPECT_THAT(light_of({.grain = 2}, scene).between.neighbours, Optional(DoubleNear(0.80, 0.05)));
}

TEST(NoiseBetween, OfOneFrameTwiceHasNoGrain) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const FrameLight light = measure_frame_light(frame.view(), frame.view(), 255);
  EXPECT_FALSE(light.between.neighbours);
  EXPECT_FALSE(light.gamma);
  EXPECT_EQ(light.noise_at(100), light.noise.at(100));
  EXPECT_TRUE(noise_between(frame.view(), Grey8(64, 64).view(), FrameChange{}, 255).levels.empty());
}

// The bands of lamps, and what moves, are no noise.
TEST(NoiseBetween, LeavesOutBandsAndMotion) {
  const SimulatedCamera camera;
  const Grey8 scene = exposed(corpus_frame("16px-5-plane_30"), 0.8, 25);
  const Grey8 first = seen_by(camera, scene, 1);
  Grey8 second = seen_by(camera, scene, 2);
  for (int y = 0; y < second.height(); ++y) {
    const double band = 8 * std::sin(4 * std::numbers::pi * y / second.height());
    for (int x = 0; x < second.width(); ++x)
      second.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(second.at(x, y) + band), 0L, 255L));
  }
  for (int y = 100; y < 200; ++y) std::copy_n(scene.row(y) + 5, 200, second.row(y) + 8);
  const FrameLight light = measure_frame_light(first.view(), second.view(), 255);
  EXPECT_THAT(light.between.neighbours, Optional(DoubleNear(0, 0.1)));
  EXPECT_NEAR(light.noise_at(100), std::sqrt(0.35 + 5.4), 0.3);
  EXPECT_GT(light.change->bands, 0.03);
  EXPECT_LT(light.change->flicker(), 0.03);
}

class Gammas : public ::testing::TestWithParam<std::tuple<double, int>> {};

TEST_P(Gammas, AreEstimatedFromTheNoise) {
  const auto [gamma, grain] = GetParam();
  const SimulatedCamera camera{.gamma = gamma, .grain = grain};
  const FrameLight light = light_of(camera, exposed(corpus_frame("16px-5-plane_30"), 1.2));
  ASSERT_TRUE(light.gamma);
  EXPECT_NEAR(light.gamma->likeliest, gamma, 0.1);
  EXPECT_LE(light.gamma->low, gamma + 0.02);
  EXPECT_GE(light.gamma->high, gamma - 0.02);
  EXPECT_EQ(light.gamma->bends(), gamma < 0.8) << light.gamma->low << " to " << light.gamma->high;
}

INSTANTIATE_TEST_SUITE_P(EstimateGamma, Gammas,
                         ::testing::Combine(::testing::Values(0.6, 0.7, 1.0), ::testing::Values(0, 1)));

TEST(EstimateGamma, SaysNothingIfTheNoiseDoesNotTell) {
  NoiseBetween constant;
  for (int i = 1; i < 16; ++i) constant.levels.push_back({16. * i, 4, 10'000});
  EXPECT_FALSE(estimate_gamma(constant, 255)) << "sensor noise alone";
  NoiseBetween few;
  for (int i = 1; i < 6; ++i) few.levels.push_back({40. * i, 2. * i, 10'000});
  EXPECT_FALSE(estimate_gamma(few, 255)) << "few levels";
  NoiseBetween falling;
  for (int i = 1; i < 16; ++i) falling.levels.push_back({16. * i, i % 2 == 0 ? 2. : 9., 10'000});
  EXPECT_FALSE(estimate_gamma(falling, 255)) << "no photon noise";
}

TEST(EstimateGamma, BearsABlackLevel) {
  NoiseBetween linear;
  for (int i = 2; i < 16; ++i) linear.levels.push_back({16. * i, 0.3 + 0.05 * (16 * i - 5), 10'000});
  const auto gamma = estimate_gamma(linear, 255);
  ASSERT_TRUE(gamma);
  EXPECT_NEAR(gamma->likeliest, 1, 0.08);
  EXPECT_FALSE(gamma->bends());
}

TEST(MeasureFrameLight, OfOneFrameHasNoChange) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const FrameLight light = measure_frame_light(frame.view(), std::nullopt, 255);
  EXPECT_FALSE(light.change);
  EXPECT_GT(light.tiles.size(), 20);
  EXPECT_LT(light.levels.room_light(), 0.5);
  EXPECT_GT(measure_frame_light(exposed(frame, 0.5, 250).view(), std::nullopt, 255).levels.room_light(), 1);
}

TEST(MeasureFrameLight, TellsTheClippedShareOfTheSymbols) {
  Grey8 half(640, 480, 20);
  for (int y = 0; y < half.height(); ++y) {
    for (int x = 0; x < half.width(); ++x)
      if (x % 16 < 8 && y % 16 < 8) half.at(x, y) = x % 16 < 4 ? 200 : 255;
  }
  EXPECT_NEAR(measure_frame_light(half.view(), std::nullopt, 255).levels.clipped_of_lit, 0.5, 1e-9);
}

}  // namespace
}  // namespace slsd
