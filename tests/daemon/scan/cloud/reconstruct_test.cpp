// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/reconstruct.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "drivers/camera/frame_pool.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr int kRoomLight = 20;

std::vector<Frame> frame_of(const GreyView& image) {
  FramePool pool(format_of(image), 1);
  std::vector<Frame> frames;
  frames.push_back(std::move(*pool.lend(image, 1, std::chrono::steady_clock::now())));
  return frames;
}

/// The cloud of a plane in a lit room, with the room's light told by a frame under a black projector.
std::vector<CloudPoint> scan(const Pattern& pattern, const std::string& format, const GreyView& lit,
                             const GreyView& dark) {
  ScanSetup setup{pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}};
  setup.camera_formats = {format};
  setup.lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, paper_rig(), 0, {})));
  FrameSet set;
  set.frames = frame_of(lit);
  set.dark = frame_of(dark);
  const auto result = reconstruct(set, setup, 0, {}, "scan");
  EXPECT_TRUE(result);
  return result->cloud.points;
}

// A dark frame alone would be taken for one of fewer bits than the pattern's.
TEST(Reconstruct, TakesTheRoomsLightFromIntensitiesAtEveryDepth) {
  const Pattern pattern = *make_pattern({});
  const Grey8 lit = simulate(draw_pattern(pattern), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), {.dark = kRoomLight});
  const Grey8 dark(lit.width(), lit.height(), kRoomLight);
  const std::vector<CloudPoint> eight = scan(pattern, "Mono8", lit.view(), dark.view());
  ASSERT_GT(eight.size(), 1000U);
  for (const int bits : {10, 12, 14, 16}) {
    const double full = (1 << bits) - 1;
    for (const std::string& format : {"Mono" + std::to_string(bits), std::string()}) {
      const auto wide = scan(pattern, format, deep(lit, full).view(), deep(dark, full).view());
      ASSERT_NEAR(static_cast<double>(wide.size()), static_cast<double>(eight.size()), 3) << bits << format;
      std::vector<int> before, after;
      for (const CloudPoint& point : eight) before.push_back(point.intensity);
      for (const CloudPoint& point : wide) after.push_back(point.intensity);
      std::ranges::sort(before), std::ranges::sort(after);
      EXPECT_NEAR(after[after.size() / 2], before[before.size() / 2], 1) << bits << format;
    }
  }
}

Result<ScanResult> scan_colours(Result<ColourFrame> colours) {
  const Pattern pattern = *make_pattern({});
  const Grey8 seen = simulate(draw_pattern(pattern), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), {});
  const Grey8 white(seen.width(), seen.height(), 100);
  ScanSetup setup{pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}};
  setup.colour_gains = {{1, 1, 2}};
  setup.lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, paper_rig(), 0, {})));
  FrameSet set;
  set.frames = frame_of(seen.view());
  set.white.push_back(std::move(frame_of(white.view()).front()).with_colours([&] { return colours; }));
  ScanRequest request;
  request.texture = request.colour = true;
  return reconstruct(set, setup, 0, request, "scan");
}

TEST(Reconstruct, GivesPointsTheColoursOfTheWhiteFrame) {
  const auto result = scan_colours(ColourFrame(1600, 1200, {10, 20, 30}));
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->cloud.coloured);
  ASSERT_GT(result->cloud.points.size(), 1000U);
  for (const CloudPoint& point : result->cloud.points) ASSERT_EQ(point.colour, (Rgb{10, 20, 60}));
  ASSERT_EQ(result->white_balance.size(), 1U);
  EXPECT_EQ(result->white_balance.front().gains, (ColourGains{2, 1, 20.0 / 30}));
}

TEST(Reconstruct, LeavesSaturatedPointsOutOfTheWhiteBalance) {
  ColourFrame half(1600, 1200, {10, 20, 40});
  for (int y = 0; y < 1200; ++y)
    for (int x = 800; x < 1600; ++x) half.at(x, y) = {200, 255, 255};
  const auto result = scan_colours(half);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->white_balance.size(), 1U);
  EXPECT_EQ(result->white_balance.front().gains, (ColourGains{2, 1, 0.5}));
  EXPECT_GT(result->saturated, result->cloud.points.size() / 4);
  const auto all = scan_colours(ColourFrame(1600, 1200, {200, 255, 255}));
  ASSERT_TRUE(all) << to_string(all.error());
  EXPECT_THAT(all->white_balance, ::testing::IsEmpty());
}

// A file may change between its frame and its colours.
TEST(Reconstruct, RefusesColoursThatDoNotFitTheFrame) {
  for (const auto& [colours, code] :
       {std::pair<Result<ColourFrame>, ErrorCode>(ColourFrame(800, 1200), ErrorCode::kMismatch),
        {fail(ErrorCode::kNotFound, "is gone"), ErrorCode::kNotFound},
        {ColourFrame(), ErrorCode::kUnsupported}}) {
    const auto result = scan_colours(colours);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, code) << to_string(result.error());
  }
}

}  // namespace
}  // namespace slsd
