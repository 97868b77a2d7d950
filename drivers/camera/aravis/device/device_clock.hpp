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

/// One reading of the device's clock: it showed `device` at some time between `before` and `after`.
struct ClockReading {
  std::chrono::nanoseconds device{0};
  MonotonicTime before;
  MonotonicTime after;
};

/// Converts ticks of a device's clock into the time since its start.
/// @param frequency_hz  above 0
/// @thread reentrant
[[nodiscard]] std::chrono::nanoseconds from_ticks(std::uint64_t ticks, std::uint64_t frequency_hz);

/// Maps a device's clock to CLOCK_MONOTONIC from its readings. The most precise reading gives the offset; a line
/// through all readings gives the drift. Without the drift, a crystal's 100 ppm would shift a frame by 0.1 ms after a
/// second. A device's clock may be set, for example when it begins to follow the network's. The first reading after
/// that discards all earlier ones. A clock that repeatedly contradicts its earlier readings is no longer ready: it
/// stands still, runs at another rate than it reports, or is set back.
/// @thread thread-bound
class DeviceClock {
 public:
  /// @param may_be_set  repeated contradictions are no fault
  explicit DeviceClock(bool may_be_set = false) : may_be_set_(may_be_set) {}

  /// @return whether the reading fits the earlier ones
  bool observe(const ClockReading& reading);

  [[nodiscard]] bool was_read() const { return count_ > 0; }
  /// The reason for distrusting the clock; empty while it is trusted.
  [[nodiscard]] std::string_view fault() const { return fault_; }
  /// Tells whether the clock can be read and trusted.
  [[nodiscard]] bool ready() const { return was_read() && fault_.empty(); }
  /// The time since which all readings fit together. Precondition: ready().
  [[nodiscard]] MonotonicTime steady_since() const { return steady_since_; }
  /// Tells whether the clock can have shown `device` before a time. If not, the clock showed it before it was set back.
  /// Precondition: ready().
  [[nodiscard]] bool may_have_shown(std::chrono::nanoseconds device, MonotonicTime before) const;
  /// Tells whether the clock can have shown `device` between two times. Precondition: ready().
  [[nodiscard]] bool may_have_shown(std::chrono::nanoseconds device, MonotonicTime after, MonotonicTime before) const;
  /// The host's time when the device's clock showed `device`. Precondition: ready().
  [[nodiscard]] MonotonicTime host_time(std::chrono::nanoseconds device) const;
  /// The reading of the device's clock at the host's time. Precondition: ready().
  [[nodiscard]] std::chrono::nanoseconds device_time(MonotonicTime host) const;
  /// The error of host_time(device): an upper bound of its standard deviation.
  [[nodiscard]] std::chrono::nanoseconds uncertainty(std::chrono::nanoseconds device) const;
  /// The drift of the device's clock against the host's, in parts per million, faster is positive; 0 until known.
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
  int fits_ = 0;                           ///< readings that fit since the last step
  std::array<ClockReading, 32> readings_;  ///< a ring buffer
  std::size_t count_ = 0;
  MonotonicTime steady_since_;
  ClockReading reference_;
  double host_per_device_ = 1.0;
  double drift_error_ = 0.0;  ///< standard error of host_per_device_
};

}  // namespace slsd
