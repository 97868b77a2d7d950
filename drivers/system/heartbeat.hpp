// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <chrono>

namespace slsd {

/// The time limit for one piece of work: decoding a frame, drawing a picture, or making a pattern and its decoders.
inline constexpr auto kWorkPromise = std::chrono::seconds(60);

/// A thread's promise of a sign of life before a certain time. A watchdog on another thread checks it.
/// @thread thread-safe
class Heartbeat {
 public:
  using Clock = std::chrono::steady_clock;

  /// Promises the next sign of life within this time from now.
  void promise(Clock::duration within) { until_ = (Clock::now() + within).time_since_epoch().count(); }

  /// Promises nothing until the next promise().
  void rest() { until_ = Clock::time_point::max().time_since_epoch().count(); }

  [[nodiscard]] bool kept(Clock::time_point now = Clock::now()) const {
    return now.time_since_epoch().count() <= until_.load();
  }

 private:
  std::atomic<Clock::rep> until_{Clock::time_point::max().time_since_epoch().count()};
};

}  // namespace slsd
