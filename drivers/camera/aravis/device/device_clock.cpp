// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device/device_clock.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

using std::chrono::nanoseconds;

constexpr double kCrystalError = 100e-6;  // a clock's error before its drift is known
constexpr double kWander = 2e-6;          // change of drift while the device warms up
constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr nanoseconds kSlack = std::chrono::milliseconds(1);  // beyond the readings' own uncertainty
constexpr int kStepsMax = 3;                                  // a single step may be an administrator's doing
constexpr int kFitsToForget = 60;
constexpr nanoseconds kFarthest = std::chrono::hours(24 * 365 * 50);

nanoseconds half_width(const ClockReading& reading) {
  return (reading.after - reading.before) / 2;
}

MonotonicTime middle(const ClockReading& reading) {
  return reading.before + half_width(reading);
}

// A device may report any number, so the difference of two may overflow.
nanoseconds between(nanoseconds from, nanoseconds to) {
  std::int64_t since = 0;
  if (__builtin_sub_overflow(to.count(), from.count(), &since)) return to > from ? kFarthest : -kFarthest;
  return std::clamp(nanoseconds(since), -kFarthest, kFarthest);
}

double seconds(nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

nanoseconds from_ticks(std::uint64_t ticks, std::uint64_t frequency_hz) {
  return nanoseconds(ticks / frequency_hz * kSecond + ticks % frequency_hz * kSecond / frequency_hz);
}

std::size_t DeviceClock::size() const {
  return std::min(count_, readings_.size());
}

// A fit across a step would give a drift that no clock has.
bool DeviceClock::observe(const ClockReading& reading) {
  const bool first = !was_read();
  const bool stepped = !first && has_stepped(reading);
  if (stepped) note_step(reading);
  if (!first && !stepped && ++fits_ >= kFitsToForget) steps_ = 0;
  if (first || stepped) {
    count_ = 0;
    steady_since_ = reading.after;
  }
  readings_[count_ % readings_.size()] = reading;
  ++count_;
  fit_drift();
  choose_reference();
  return !stepped;
}

void DeviceClock::note_step(const ClockReading& reading) {
  fits_ = 0;
  if (may_be_set_ || ++steps_ < kStepsMax || !fault_.empty()) return;
  if (reading.device == newest().device)
    fault_ = "stands still";
  else if (reading.device < newest().device)
    fault_ = "keeps jumping back";
  else
    fault_ = "does not run at the rate that it states";
}

bool DeviceClock::has_stepped(const ClockReading& reading) const {
  const nanoseconds off = std::chrono::abs(host_time(reading.device) - middle(reading));
  return off > uncertainty(reading.device) + half_width(reading) + kSlack;
}

bool DeviceClock::may_have_shown(nanoseconds device, MonotonicTime before) const {
  return host_time(device) <= before + uncertainty(device) + kSlack;
}

bool DeviceClock::may_have_shown(nanoseconds device, MonotonicTime after, MonotonicTime before) const {
  return may_have_shown(device, before) && host_time(device) >= after - uncertainty(device) - kSlack;
}

// Least squares; each reading is weighted by its precision.
void DeviceClock::fit_drift() {
  const ClockReading& origin = newest();
  double weights = 0, x_sum = 0, y_sum = 0, xx_sum = 0, xy_sum = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    const double x = seconds(readings_[i].device - origin.device);
    const double y = seconds(middle(readings_[i]) - middle(origin)) - x;
    const double weight = 1.0 / std::pow(std::max(seconds(half_width(readings_[i])), 1e-6), 2);
    weights += weight, x_sum += weight * x, y_sum += weight * y, xx_sum += weight * x * x, xy_sum += weight * x * y;
  }
  const double spread = xx_sum - x_sum * x_sum / weights;
  host_per_device_ = 1.0;
  drift_error_ = kCrystalError;
  const double error = kWander + 1.0 / std::sqrt(std::max(spread, 1e-9));
  if (error > kCrystalError) return;
  host_per_device_ += (xy_sum - x_sum * y_sum / weights) / spread;
  drift_error_ = error;
}

void DeviceClock::choose_reference() {
  reference_ = newest();
  for (std::size_t i = 0; i < size(); ++i) {
    const auto aged = [&](const ClockReading& reading) {
      return seconds(half_width(reading)) + drift_error_ * seconds(newest().device - reading.device);
    };
    if (aged(readings_[i]) < aged(reference_)) reference_ = readings_[i];
  }
}

MonotonicTime DeviceClock::host_time(nanoseconds device) const {
  const auto since = static_cast<double>(between(reference_.device, device).count());
  return middle(reference_) + nanoseconds(std::llround(since * host_per_device_));
}

nanoseconds DeviceClock::device_time(MonotonicTime host) const {
  const auto since = static_cast<double>((host - middle(reference_)).count());
  return reference_.device + nanoseconds(std::llround(since / host_per_device_));
}

nanoseconds DeviceClock::uncertainty(nanoseconds device) const {
  const double since = std::abs(static_cast<double>(between(reference_.device, device).count()));
  return half_width(reference_) + nanoseconds(std::llround(since * drift_error_));
}

}  // namespace slsd
