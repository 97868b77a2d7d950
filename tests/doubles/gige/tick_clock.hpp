// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>

#include "tests/doubles/gige/gige_camera_options.hpp"
#include "tests/doubles/gige/register_file.hpp"

namespace slsd::test {

/// The clock that the double stamps by: its own, which drifts, or the network's where PTP is on, which is this host's.
/// @thread thread-bound
class TickClock {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Goes from now on.
  /// @param registers     where it is shown; they outlive this
  /// @param frequency_hz  of its own
  /// @param drift_ppm     how much faster than the host's its own goes
  /// @param fault         of what latch() shows
  TickClock(RegisterFile& registers, std::uint64_t frequency_hz, double drift_ppm, ClockFault fault);

  /// Shows how often it ticks: after PTP was turned on or off.
  void show_frequency();
  void set_fault(ClockFault fault) { fault_ = fault; }
  /// Shows what it is now.
  void latch();

  [[nodiscard]] std::uint64_t frequency_hz() const;
  [[nodiscard]] std::uint64_t ticks_at(Time time) const;
  /// So many ticks in nanoseconds.
  [[nodiscard]] std::uint64_t in_ns(std::uint64_t ticks) const;
  /// When the network's clock shows so much.
  [[nodiscard]] static Time network_time(std::uint64_t ticks) { return Time(std::chrono::nanoseconds(ticks)); }

 private:
  [[nodiscard]] bool follows_network() const;
  [[nodiscard]] std::uint64_t shown(std::uint64_t ticks);

  RegisterFile& registers_;
  std::uint64_t own_frequency_hz_;
  double drift_ppm_;
  ClockFault fault_;
  std::uint64_t latches_ = 0;
  Time begin_ = std::chrono::steady_clock::now();
};

}  // namespace slsd::test
