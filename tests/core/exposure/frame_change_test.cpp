// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_change.hpp"

#include <random>

#include <gmock/gmock.h>

#include "tests/core/exposure/corpus_frame.hpp"

namespace slsd {
namespace {

using ::testing::DoubleNear;

Grey8 with_noise(const Grey8& frame, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma);
  Grey8 image = frame;
  for (std::size_t i = 0; i < image.size(); ++i) {
    image.data()[i] = static_cast<std::uint8_t>(std::clamp(std::lround(frame.data()[i] + noise(random)), 0L, 255L));
  }
  return image;
}

TEST(CompareFrames, TellsTheNoise) {
  const Grey8 frame(640, 480, 100);
  const FrameChange change = compare_frames(with_noise(frame, 4, 1).view(), with_noise(frame, 4, 2).view());
  EXPECT_THAT(change.noise, DoubleNear(4, 0.2));
  EXPECT_EQ(change.moved_share, 0);
  EXPECT_THAT(change.flicker(), DoubleNear(0, 0.002));
}

TEST(CompareFrames, OfOneFrameHasNoChange) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const FrameChange change = compare_frames(frame.view(), frame.view());
  EXPECT_EQ(change.noise, 0);
  EXPECT_EQ(change.moved_share, 0);
  EXPECT_EQ(change.flicker(), 0);
}

TEST(CompareFrames, SeesWhatMoves) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  Grey8 moved = with_noise(frame, 2, 1);
  for (int y = 100; y < 300; ++y) std::copy_n(frame.row(y) + 5, 300, moved.row(y) + 8);
  const FrameChange change = compare_frames(with_noise(frame, 2, 2).view(), moved.view());
  EXPECT_GT(change.moved_share, 0.15);
  EXPECT_LT(change.moved_share, 0.35);
}

TEST(CompareFrames, SeesFlickerAndTakesItForNoMotion) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const FrameChange change = compare_frames(frame.view(), exposed(frame, 1.2).view());
  EXPECT_THAT(change.brighter, DoubleNear(1.2, 0.01));
  EXPECT_THAT(change.flicker(), DoubleNear(0.2, 0.01));
  EXPECT_THAT(compare_frames(exposed(frame, 1.2).view(), frame.view()).flicker(), DoubleNear(0.2, 0.01));
  EXPECT_EQ(change.moved_share, 0);
}

TEST(CompareFrames, OfDifferentSizesFindsNothing) {
  const FrameChange change = compare_frames(Grey8(64, 64).view(), Grey16(64, 64).view());
  EXPECT_EQ(change.noise, 0);
  EXPECT_EQ(compare_frames(Grey8(64, 64, 1).view(), Grey8(128, 64, 9).view()).brighter, 1);
}

}  // namespace
}  // namespace slsd
