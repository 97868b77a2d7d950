// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Frames of more than 8 bits, against the same light in 8.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/decode/decoder.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using test::decode;
using test::decoder_of;
using test::frame_of;
using test::kCylinder;
using test::kPlane;
using test::wrong_points;

class DeepFrame : public testing::TestWithParam<int> {};

/// A point of the same cell; nothing where there is none.
const CloudPoint* same_cell(const Decoding& decoding, const CloudPoint& point) {
  const auto same = [&](const CloudPoint& other) { return other.row == point.row && other.column == point.column; };
  const auto found = std::ranges::find_if(decoding.points, same);
  return found == decoding.points.end() ? nullptr : &*found;
}

// Grey values are rounded anew, at 10 bits to an eighth of a level, and what lies at a limit falls to its other side:
// that moves one centre in fifty by more than a hundredth of a pixel, none by more than four. What is at the limit
// of being a symbol may come or go, one in five hundred.
TEST_P(DeepFrame, GivesThePointsOfEightBits) {
  const double full = (1 << GetParam()) - 1;
  const Pattern pattern = shipped_pattern("16px-5.toml");
  for (const double light : {1.0, 0.3}) {
    const Grey8 frame =
        simulate(draw_pattern(pattern), paper_rig(), kCylinder, {.dark = 20 * light, .lit = 170 * light});
    Decoder decoder = decoder_of(pattern);
    const Decoding eight = decode(decoder, frame.view());
    const auto decoded = decoder.decode(deep(frame, full).view(), full);
    ASSERT_TRUE(decoded);
    const Decoding& wide = **decoded;
    ASSERT_GT(eight.points.size(), 500U);
    EXPECT_NEAR(static_cast<double>(wide.points.size()), static_cast<double>(eight.points.size()),
                0.002 * static_cast<double>(eight.points.size()));
    EXPECT_EQ(wrong_points(wide, kCylinder, 2), 0);
    std::size_t shared = 0, moved = 0;
    for (const CloudPoint& point : eight.points) {
      const CloudPoint* same = same_cell(wide, point);
      if (same == nullptr) continue;
      ++shared;
      const double by_px = std::hypot(same->camera_u - point.camera_u, same->camera_v - point.camera_v);
      EXPECT_LT(by_px, 0.04);
      moved += by_px > 0.01 ? 1 : 0;
      EXPECT_NEAR(same->intensity, point.intensity, 1);
    }
    EXPECT_LE(static_cast<double>(moved), 0.02 * static_cast<double>(shared));
    EXPECT_GE(static_cast<double>(shared), 0.998 * static_cast<double>(eight.points.size()));
  }
}

INSTANTIATE_TEST_SUITE_P(Bits, DeepFrame, testing::Values(10, 12, 14, 16));

TEST(Decode, GuessesTheLevelsOfADeepFrame) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frame = frame_of(pattern, kPlane);
  Decoder decoder = decoder_of(pattern);
  for (const int bits : {10, 12, 14, 16}) {
    const double full = (1 << bits) - 1;
    const Grey16 wide = deep(frame, full);
    const Decoding told = **decoder.decode(wide.view(), full);
    EXPECT_EQ(decode(decoder, wide.view()).points, told.points) << bits;
    EXPECT_GT(told.points.size(), 1000U) << bits;
  }
}

}  // namespace
}  // namespace slsd
