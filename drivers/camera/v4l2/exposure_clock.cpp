// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/exposure_clock.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr std::chrono::milliseconds kUnknownPeriod{100};
constexpr int kPeriodsWithoutFrame = 4;
constexpr std::chrono::milliseconds kLeastPause{100};     // a busy host may pause this long
constexpr std::chrono::milliseconds kSilenceLeast{1000};  // stalls of a shared bus are shorter
constexpr std::chrono::milliseconds kFuture{1};           // a stamp is never later than its frame, except for rounding
constexpr int kSameStampsMax = 3;

std::chrono::nanoseconds time_of(const timeval& time) {
  return std::chrono::seconds(time.tv_sec) + std::chrono::microseconds(time.tv_usec);
}

}  // namespace

ExposureClock::ExposureClock(const ExposureTiming& timing, const V4l2CameraOptions& options, const std::string& driver)
    : stamps_first_packet_(driver == "uvcvideo") {
  period_ = timing.period.value_or(kUnknownPeriod);
  exposure_ = timing.exposure.value_or(period_);
  readout_ = options.readout_us ? std::chrono::nanoseconds(std::llround(1e3 * *options.readout_us)) : period_;
}

void ExposureClock::note(const v4l2_buffer& buffer, MonotonicTime received) {
  if (!is_stamped(buffer)) return;
  const auto stamp = time_of(buffer.timestamp);
  same_stamps_ = stamp == last_stamp_ && buffer.sequence != last_sequence_ ? same_stamps_ + 1 : 0;
  last_stamp_ = stamp;
  last_sequence_ = buffer.sequence;
  trusted_ = MonotonicTime(stamp) <= received + kFuture && same_stamps_ < kSameStampsMax;
}

bool ExposureClock::is_stamped(const v4l2_buffer& buffer) const {
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  return trusted_ && monotonic && time_of(buffer.timestamp).count() > 0;
}

MonotonicTime ExposureClock::exposure_start(const v4l2_buffer& buffer, MonotonicTime received) const {
  if (!is_stamped(buffer)) return received - readout_ - exposure_;
  const MonotonicTime stamped = std::min(MonotonicTime(time_of(buffer.timestamp)), received);
  const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (!at_start) return stamped - readout_ - exposure_;
  return stamps_first_packet_ ? stamped - exposure_ : stamped;
}

int ExposureClock::frames_in_flight() const {
  return static_cast<int>((exposure_ + readout_ + period_ - std::chrono::nanoseconds(1)) / period_);
}

std::chrono::nanoseconds ExposureClock::silence_max(int missed_frames_max) const {
  const auto frame = std::max(period_, exposure_);
  return std::max<std::chrono::nanoseconds>(exposure_ + readout_ + missed_frames_max * frame, kSilenceLeast);
}

std::chrono::nanoseconds ExposureClock::next_frame_age_max() const {
  return exposure_ + readout_ + std::max<std::chrono::nanoseconds>(kPeriodsWithoutFrame * period_, kLeastPause);
}

}  // namespace slsd
