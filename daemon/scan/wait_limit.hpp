// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "daemon/configuration/scan_options.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The limits of a wait for devices: its deadline, what ends it sooner, and who is notified meanwhile. Waits proceed in
/// steps of at most one second, however far the deadline is.
/// @thread thread-bound
struct WaitLimit {
  static constexpr std::chrono::milliseconds kStep{1000};

  WaitLimit(MonotonicTime until, std::stop_token ended = {}) : deadline(until), over(std::move(ended)) {}  // NOLINT

  MonotonicTime deadline;
  std::stop_token over;                               ///< requested: nobody waits any more
  std::function<void(const std::string&)> waits_for;  ///< called with each device waited for: "camera left"
  std::function<void()> alive;                        ///< called before each step
  std::function<bool(const Error&)> again;            ///< whether lost frames deserve another try; empty: they do not

  /// Reports the device that is waited for from now on.
  void note(const std::string& device) const {
    if (waits_for) waits_for(device);
  }

  /// The end of the current step.
  [[nodiscard]] MonotonicTime step(MonotonicTime until) const {
    if (alive) alive();
    return std::min<MonotonicTime>(until, std::chrono::steady_clock::now() + kStep);
  }

  /// Waits until the condition holds. @return whether it does; false: the time came, or nobody waits any more
  template <class Holds>
  bool wait_until(MonotonicTime until, std::condition_variable_any& changed, std::unique_lock<std::mutex>& lock,
                  Holds holds) const {
    while (!holds()) {
      if (over.stop_requested() || std::chrono::steady_clock::now() >= until) return false;
      changed.wait_until(lock, over, step(until), holds);
    }
    return true;
  }
};

/// The pauses between attempts to open a device. Each is twice as long as the one before, up to a maximum.
/// @thread thread-bound
class Backoff {
 public:
  explicit Backoff(const ScanOptions& options)
      : first_(options.reopen_first_ms), longest_(options.reopen_longest_ms), next_(first_) {}

  /// The pause before the next attempt.
  [[nodiscard]] std::chrono::milliseconds next() {
    const auto pause = next_;
    next_ = std::min(2 * next_, longest_);
    return pause;
  }
  void reset() { next_ = first_; }

 private:
  std::chrono::milliseconds first_;
  std::chrono::milliseconds longest_;
  std::chrono::milliseconds next_;
};

}  // namespace slsd
