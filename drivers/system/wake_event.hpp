// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <chrono>

#include "core/result.hpp"

namespace slsd {

/// Ends a wait of another thread, in poll() or for a time. A wake() that meets nobody waiting ends the next wait, also
/// one that comes before open(), or while no descriptor is left.
/// @thread thread-safe; open(), the waits and the destructor belong to one thread
class WakeEvent {
 public:
  using Time = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;
  enum class Woken {
    kReady,  ///< the other descriptor has something to read
    kGone,   ///< it failed, or was hung up
    kWoken,  ///< wake() was called; it is reset
    kLate    ///< the time is there
  };

  WakeEvent() = default;
  ~WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  /// Opens the event, before the first wait. Does nothing if it is open already.
  /// @errors kNoSpace: no descriptor is left
  [[nodiscard]] Result<> open();

  /// The descriptor for a poll() of one's own: readable once woken, until reset(). -1 before open().
  [[nodiscard]] int descriptor() const { return number_; }

  /// Waits until the descriptor has something to read, with an end at the time. A time in the past looks only.
  [[nodiscard]] Woken wait(int descriptor, Time until) const;

  /// Sleeps until the time, or until woken: then true, and it is reset. A time in the past looks only.
  [[nodiscard]] bool sleep_until(Time until) const;

  void wake() const;
  void reset() const;

 private:
  [[nodiscard]] bool take() const;

  std::atomic<int> number_{-1};             ///< an eventfd; opened once, closed at the end
  mutable std::atomic<bool> woken_{false};  ///< the truth; the event only ends the poll()
};

}  // namespace slsd
