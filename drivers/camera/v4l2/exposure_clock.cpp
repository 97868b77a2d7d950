// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/exposure_clock.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr std::chrono::milliseconds kPeriodUnknown{100};

std::chrono::nanoseconds nanoseconds(const timeval& time) {
  return std::chrono::seconds(time.tv_sec) + std::chrono::microseconds(time.tv_usec);
}

}  // namespace

ExposureClock::ExposureClock(const ExposureTiming& timing, const V4l2CameraOptions& options, const std::string& driver)
    : stamps_first_packet_(driver == "uvcvideo") {
  const auto period = timing.period.value_or(kPeriodUnknown);
  exposure_ = timing.exposure.value_or(period);
  readout_ = options.readout_us ? std::chrono::nanoseconds(std::llround(1e3 * *options.readout_us)) : period;
}

MonotonicTime ExposureClock::exposure_start(const v4l2_buffer& buffer, MonotonicTime received) const {
  const std::chrono::nanoseconds stamp = nanoseconds(buffer.timestamp);
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!monotonic || stamp.count() <= 0) return received - readout_ - exposure_;
  const MonotonicTime stamped = std::min(MonotonicTime(stamp), received);
  const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (!at_start) return stamped - readout_ - exposure_;
  return stamps_first_packet_ ? stamped - exposure_ : stamped;
}

}  // namespace slsd
