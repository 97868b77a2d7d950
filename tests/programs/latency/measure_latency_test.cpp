// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/latency/measure_latency.hpp"

#include <gmock/gmock.h>

#include "tests/programs/latency/late_projector.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

Result<CameraLatency> measure(DarkRoom& room, const LatencyOptions& options = {}) {
  LateProjector projector(room);
  RoomCamera camera(room);
  return measure_latency(projector, camera, options, room.timepiece());
}

/// Refreshes by which the projector is late, and the camera's frames a second.
class Late : public ::testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(Late, IsFoundWithinAFrame) {
  const auto [refreshes, rate_hz] = GetParam();
  DarkRoom room;
  room.late = refreshes * room.refresh;
  room.frame = std::chrono::nanoseconds(1s) / rate_hz;
  room.exposure = std::min(room.exposure, room.frame);
  const auto latency = measure(room);
  ASSERT_TRUE(latency) << to_string(latency.error());
  EXPECT_EQ(latency->camera, "left");
  EXPECT_EQ(latency->flashes, 20);
  // A frame with 90 % of the white counts as whole, and the camera's own pace decides when the first one begins.
  const auto soonest = room.late - room.exposure / 10;
  EXPECT_GE(latency->latency, soonest);
  EXPECT_LE(latency->latency, room.late + room.frame);
  EXPECT_GE(latency->p05, soonest);
  EXPECT_LE(latency->p05, latency->median);
  EXPECT_LE(latency->median, latency->p95);
  EXPECT_LE(latency->p95, room.late + room.frame);
  EXPECT_FALSE(latency->clipped);
}

INSTANTIATE_TEST_SUITE_P(MeasureLatency, Late,
                         ::testing::Combine(::testing::Values(1, 2, 3, 4, 5, 6), ::testing::Values(15, 31, 60, 107)));

// The flashes meet the camera at every phase, so that the spread shows its pace and the latency does not.
TEST(MeasureLatency, TellsTheLatencyFromTheCamerasPace) {
  DarkRoom room;
  room.late = 40ms;
  room.frame = 101ms;
  LatencyOptions options;
  options.flashes = 200;
  const auto latency = measure(room, options);
  ASSERT_TRUE(latency) << to_string(latency.error());
  EXPECT_GT(latency->p95 - latency->p05, 70ms);
  EXPECT_GT(latency->latency, 36ms);
  EXPECT_LT(latency->latency, 46ms);
}

// What began sooner than every frame seen may have been incomplete.
TEST(MeasureLatency, IsTheSoonestFrameWhereAllAreWhole) {
  DarkRoom room;
  room.frame = 21ms;
  const auto latency = measure(room);
  ASSERT_TRUE(latency) << to_string(latency.error());
  EXPECT_LE(latency->latency, latency->p05);
  EXPECT_LE(latency->latency, 5ms);
  EXPECT_LE(latency->p95, 21ms);
}

TEST(MeasureLatency, PassesOverLostFrames) {
  DarkRoom room;
  room.late = 50ms;
  room.lost_every = 3;
  const auto latency = measure(room);
  ASSERT_TRUE(latency) << to_string(latency.error());
  EXPECT_GT(latency->latency, 45ms);
  EXPECT_LE(latency->latency, 50ms + 2 * room.frame);
}

TEST(MeasureLatency, SaysThatFramesAreClipped) {
  DarkRoom room;
  room.late = 50ms;
  room.white = 5000;
  const auto latency = measure(room);
  ASSERT_TRUE(latency) << to_string(latency.error());
  EXPECT_TRUE(latency->clipped);
}

TEST(MeasureLatency, RefusesWhereNoFlashIsSeen) {
  DarkRoom room;
  room.white = 0;
  const auto latency = measure(room);
  ASSERT_FALSE(latency);
  EXPECT_EQ(latency.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(latency.error().message, HasSubstr("the camera saw no flash"));
}

TEST(MeasureLatency, RefusesWhereTheLightComesTooLate) {
  DarkRoom room;
  room.late = 290ms;
  LatencyOptions options;
  options.timeout = 100ms;
  const auto latency = measure(room, options);
  ASSERT_FALSE(latency);
  EXPECT_EQ(latency.error().code, ErrorCode::kTimeout);
}

TEST(MeasureLatency, GivesUpOnACameraThatLosesEveryFrame) {
  DarkRoom room;
  room.lost_every = 1;
  const auto latency = measure(room);
  ASSERT_FALSE(latency);
  EXPECT_EQ(latency.error().code, ErrorCode::kFrameDropped);
}

}  // namespace
}  // namespace slsd
