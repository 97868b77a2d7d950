// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// The device's clock, read once: it showed `device` at some time between `before` and `after`.
struct ClockReading {
  std::chrono::nanoseconds device{0};
  MonotonicTime before;
  MonotonicTime after;
};

/// Turns ticks of a device's clock into the time since it began.
/// @param frequency_hz  above 0
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds from_ticks(std::uint64_t ticks, std::uint64_t frequency_hz);

/// Maps a device's clock to CLOCK_MONOTONIC by the readings that it is given: the offset by the one that is known best,
/// the drift by the line through all of them. Without drift a crystal's 100 ppm would put a frame 0.1 ms off after a
/// second. A device's clock may be set, as one is that begins to follow the network's: from the first reading after it
/// on, what was read before is forgotten. One that does not fit the readings before again and again, because it stands
/// still, goes at another rate than it says or is set back, is not ready any more.
/// @thread thread-bound
class DeviceClock {
 public:
  /// @param may_be_set  what does not fit is no fault, however often
  explicit DeviceClock(bool may_be_set = false) : may_be_set_(may_be_set) {}

  /// @return whether it fits the readings before
  bool observe(const ClockReading& reading);

  [[nodiscard]] bool was_read() const { return count_ > 0; }
  /// The reason for not trusting the clock; empty while it is trusted.
  [[nodiscard]] std::string_view fault() const { return fault_; }
  /// Tells whether the clock can be read, and trusted.
  [[nodiscard]] bool ready() const { return was_read() && fault_.empty(); }
  /// The time since when all readings were of one course of the clock. Precondition: ready().
  [[nodiscard]] MonotonicTime steady_since() const { return steady_since_; }
  /// Tells whether the device's clock can have shown `device` before a time. What it shows only later was shown before
  /// it was set back. Precondition: ready().
  [[nodiscard]] bool may_have_shown(std::chrono::nanoseconds device, MonotonicTime before) const;
  /// Tells whether it can have shown `device` between two times. Precondition: ready().
  [[nodiscard]] bool may_have_shown(std::chrono::nanoseconds device, MonotonicTime after, MonotonicTime before) const;
  /// The host's time when the device's clock showed `device`. Precondition: ready().
  [[nodiscard]] MonotonicTime host_time(std::chrono::nanoseconds device) const;
  /// The reading of the device's clock at the host's time. Precondition: ready().
  [[nodiscard]] std::chrono::nanoseconds device_time(MonotonicTime host) const;
  /// The error of host_time() of this, as a standard deviation at most.
  [[nodiscard]] std::chrono::nanoseconds uncertainty(std::chrono::nanoseconds device) const;
  /// The rate by which the device's clock is faster than the host's, in parts per million; 0 until it is known.
  [[nodiscard]] double drift_ppm() const { return (1.0 / host_per_device_ - 1.0) * 1e6; }

 private:
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] const ClockReading& newest() const { return readings_[(count_ - 1) % readings_.size()]; }
  [[nodiscard]] bool has_stepped(const ClockReading& reading) const;
  void note_step(const ClockReading& reading);
  void fit_drift();
  void choose_reference();

  bool may_be_set_;
  std::string_view fault_;
  int steps_ = 0;                          ///< recent steps
  int fits_ = 0;                           ///< fits since the last of them
  std::array<ClockReading, 32> readings_;  ///< a ring
  std::size_t count_ = 0;
  MonotonicTime steady_since_;
  ClockReading reference_;
  double host_per_device_ = 1.0;
  double drift_error_ = 0.0;  ///< standard error of host_per_device_
};

}  // namespace slsd
