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
  EXPECT_TRUE(ExposureClock::is_stamped(stamped(kSoe, 999)));
  EXPECT_FALSE(ExposureClock::is_stamped(stamped(kSoe, 0)));
  EXPECT_FALSE(ExposureClock::is_stamped(stamped(V4L2_BUF_FLAG_TIMESTAMP_COPY, 999)));
}

TEST(ExposureStart, IsNeverAfterTheArrival) {
  EXPECT_EQ(clock_of({5ms, 16ms}).exposure_start(stamped(kSoe, 2000), kReceived), kReceived);
}

}  // namespace
}  // namespace slsd
