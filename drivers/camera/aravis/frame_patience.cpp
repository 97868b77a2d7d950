// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frame_patience.hpp"

#include <algorithm>
#include <cstdint>

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kFirstFrame{250};   // readout and transfer
constexpr milliseconds kLaterFrame{3000};  // of the slowest, over a busy network
constexpr int kWaysToOpen = 2;             // with chunks, and without
constexpr milliseconds kPeriodUnknown{100};
constexpr int kPeriodsToNext = 5;         // one of them for readout and transfer
constexpr milliseconds kPauseLeast{100};  // which a busy host makes without anyone's doing

/// Until the exposure has ended.
nanoseconds exposure_time(const AravisCameraOptions& options) {
  const double period_us = options.rate_hz > 0.0 ? 1e6 / options.rate_hz : 0.0;
  return from_us(options.exposure_us + options.action_lead_us + period_us);
}

}  // namespace

nanoseconds from_us(double duration_us) {
  return nanoseconds(static_cast<std::int64_t>(duration_us * 1e3));
}

nanoseconds frame_patience(const AravisCameraOptions& options) {
  return milliseconds(options.frame_timeout_ms) + exposure_time(options);
}

nanoseconds first_frame_patience(const AravisCameraOptions& options, AravisTrigger trigger, int tries_before) {
  const double period_us = trigger == AravisTrigger::kFreeRun && options.rate_hz > 0.0 ? 1e6 / options.rate_hz : 0.0;
  const milliseconds transfer = tries_before == 0 ? kFirstFrame : kLaterFrame;
  return std::min(milliseconds(options.frame_timeout_ms), transfer) + from_us(options.exposure_us + period_us);
}

nanoseconds first_frame_time_max(const AravisCameraOptions& options) {
  nanoseconds time{0};
  for (int i = 0; i < kFirstFrameTries; ++i) time += first_frame_patience(options, options.trigger, i);
  return kWaysToOpen * time;
}

nanoseconds next_frame_age_max(const AravisCameraOptions& options) {
  const nanoseconds period = options.rate_hz > 0.0 ? from_us(1e6 / options.rate_hz) : kPeriodUnknown;
  return from_us(options.exposure_us) + std::max<nanoseconds>(kPeriodsToNext * period, kPauseLeast);
}

}  // namespace slsd
