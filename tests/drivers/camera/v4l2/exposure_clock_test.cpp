// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/exposure_clock.hpp"

#include <linux/videodev2.h>

#include <gtest/gtest.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;

const MonotonicTime kReceived(1000s);
constexpr std::uint32_t kSoe = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
constexpr std::uint32_t kEof = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;

v4l2_buffer stamped(std::uint32_t flags, int seconds, int microseconds = 0) {
  v4l2_buffer buffer{};
  buffer.flags = flags;
  buffer.timestamp = {seconds, microseconds};
  return buffer;
}

ExposureClock clock_of(ExposureTiming timing, const char* driver = "driver", std::optional<double> readout_us = {}) {
  V4l2CameraOptions options;
  options.readout_us = readout_us;
  return {timing, options, driver};
}

TEST(ExposureStart, IsTheStampOfADriverThatStampsIt) {
  EXPECT_EQ(clock_of({5ms, 16ms}).exposure_start(stamped(kSoe, 999, 250), kReceived), MonotonicTime(999s + 250us));
}

TEST(ExposureStart, LiesBeforeUvcvideosFirstPacketByTheExposure) {
  EXPECT_EQ(clock_of({5ms, 16ms}, "uvcvideo").exposure_start(stamped(kSoe, 999), kReceived), MonotonicTime(999s - 5ms));
}

TEST(ExposureStart, LiesBeforeTheEndByExposureAndReadout) {
  EXPECT_EQ(clock_of({5ms, 16ms}).exposure_start(stamped(kEof, 999), kReceived), MonotonicTime(999s - 21ms));
  EXPECT_EQ(clock_of({5ms, 16ms}, "driver", 2500).exposure_start(stamped(kEof, 999), kReceived),
            MonotonicTime(999s - 7500us));
}

TEST(ExposureStart, IsAsEarlyAsItCanBeWhereTheExposureIsNotKnown) {
  EXPECT_EQ(clock_of({{}, 16ms}).exposure_start(stamped(kEof, 999), kReceived), MonotonicTime(999s - 32ms));
}

TEST(ExposureStart, IsCountedFromTheArrivalWithoutAStampOfThisClock) {
  for (const auto& buffer :
       {stamped(V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, 999), stamped(V4L2_BUF_FLAG_TIMESTAMP_COPY, 999), stamped(kSoe, 0)}) {
    EXPECT_EQ(clock_of({5ms, 16ms}).exposure_start(buffer, kReceived), kReceived - 21ms);
  }
}

TEST(FramesInFlight, AreAsManyAsExposureAndReadoutTouch) {
  EXPECT_EQ(clock_of({5ms, 16ms}).frames_in_flight(), 2);
  EXPECT_EQ(clock_of({{}, 16ms}).frames_in_flight(), 2);
  EXPECT_EQ(clock_of({5ms, 16ms}, "driver", 8000).frames_in_flight(), 1);
  EXPECT_EQ(clock_of({40ms, 16ms}, "driver", 8000).frames_in_flight(), 3);
}

TEST(IsStamped, AsksForThisClock) {
  const ExposureClock clock;
  EXPECT_TRUE(clock.is_stamped(stamped(kSoe, 999)));
  EXPECT_FALSE(clock.is_stamped(stamped(kSoe, 0)));
  EXPECT_FALSE(clock.is_stamped(stamped(V4L2_BUF_FLAG_TIMESTAMP_COPY, 999)));
}

TEST(ExposureStart, IsNeverAfterTheArrival) {
  EXPECT_EQ(clock_of({5ms, 16ms}).exposure_start(stamped(kSoe, 2000), kReceived), kReceived);
}

/// Notes buffers one after the other, each stamped so many seconds after the one before.
ExposureClock clock_after(int first, int step, int count) {
  ExposureClock clock = clock_of({5ms, 16ms});
  for (int i = 0; i < count; ++i) {
    v4l2_buffer buffer = stamped(kSoe, first + i * step);
    buffer.sequence = static_cast<std::uint32_t>(i);
    clock.note(buffer, kReceived);
  }
  return clock;
}

// uvcvideo with clock=realtime says CLOCK_MONOTONIC and stamps the time of day, which others set.
TEST(ExposureClock, TrustsNoStampOfTheFuture) {
  EXPECT_TRUE(clock_after(900, 10, 11).is_trusted());
  const ExposureClock clock = clock_after(1'800'000'000, 0, 1);
  EXPECT_FALSE(clock.is_trusted());
  EXPECT_FALSE(clock.is_stamped(stamped(kSoe, 999)));
  EXPECT_EQ(clock.exposure_start(stamped(kSoe, 999), kReceived), kReceived - 21ms);
}

TEST(ExposureClock, TrustsNoClockThatStandsStill) {
  EXPECT_TRUE(clock_after(999, 0, 3).is_trusted());
  EXPECT_FALSE(clock_after(999, 0, 4).is_trusted());
}

TEST(SilenceMax, IsSoManyFramesAndASecondAtLeast) {
  EXPECT_EQ(clock_of({5ms, 16ms}).silence_max(3), 1s);
  EXPECT_EQ(clock_of({5ms, 500ms}).silence_max(3), 2005ms);  // a period for the readout
  EXPECT_EQ(clock_of({2s, 500ms}).silence_max(3), 8500ms);   // no camera gives frames faster than it exposes
  EXPECT_EQ(clock_of({5ms, 500ms}).silence_max(10), 5505ms);
}

}  // namespace
}  // namespace slsd
