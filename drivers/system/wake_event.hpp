// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <chrono>

#include "core/result.hpp"

namespace slsd {

/// Ends a wait of another thread, in poll() or for a time. If nobody waits, wake() ends the next wait, even before
/// open() or without a descriptor.
/// @thread thread-safe; open(), the waits and the destructor belong to one thread
class WakeEvent {
 public:
  using Time = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;
  enum class Woken {
    kReady,  ///< the other descriptor has something to read
    kGone,   ///< the other descriptor failed, or was hung up
    kWoken,  ///< wake() was called; it is reset
    kLate    ///< the time has come
  };

  WakeEvent() = default;
  ~WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  /// Opens the event, before the first wait. Does nothing if it is already open.
  /// @errors kNoSpace: no descriptor is available
  [[nodiscard]] Result<> open();

  /// The descriptor for an own poll(): readable once woken, until reset(). -1 before open().
  [[nodiscard]] int descriptor() const { return number_; }

  /// Waits until the descriptor has something to read, until the time at most. With a past time, only checks.
  [[nodiscard]] Woken wait(int descriptor, Time until) const;

  /// Sleeps until the time, or until woken: then returns true and resets. With a past time, only checks.
  [[nodiscard]] bool sleep_until(Time until) const;

  void wake() const;
  void reset() const;

 private:
  [[nodiscard]] bool take() const;

  std::atomic<int> number_{-1};             ///< an eventfd; opened once, closed in the destructor
  mutable std::atomic<bool> woken_{false};  ///< the actual state; the event only ends poll()
};

}  // namespace slsd
