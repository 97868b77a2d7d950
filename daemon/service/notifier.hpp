// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace slsd {

/// Reports the service's state to the service manager with sd_notify(3). Does nothing without NOTIFY_SOCKET. After
/// stopping() it reports no other state: a reload that ends then would call the service ready.
/// @thread thread-bound
class Notifier {
 public:
  /// Reports that the service is not ready yet, and that the next step takes at most this long, whatever
  /// TimeoutStartSec= says.
  void starting(const std::string& status, std::chrono::microseconds time_max) const;
  void ready(const std::string& status) const;
  void status(const std::string& status) const;
  void reloading() const;
  void stopping();
  void ping_watchdog() const;

  /// The interval within which the manager expects a ping. Empty if it does not watch.
  [[nodiscard]] static std::optional<std::chrono::microseconds> watchdog_time();

 private:
  bool stopping_ = false;
};

}  // namespace slsd
