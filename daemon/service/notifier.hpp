// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace slsd {

/// Tells the service manager how the service is, by sd_notify(3). Without NOTIFY_SOCKET it does nothing.
/// @thread thread-bound
class Notifier {
 public:
  /// It is not ready yet, and takes at most so long for what comes next, whatever TimeoutStartSec= says.
  void starting(const std::string& status, std::chrono::microseconds time_max) const;
  void ready(const std::string& status) const;
  void status(const std::string& status) const;
  void reloading() const;
  void stopping() const;
  void ping_watchdog() const;

  /// The time within which the manager expects a ping before it acts. Empty if it does not watch.
  [[nodiscard]] static std::optional<std::chrono::microseconds> watchdog_time();
};

}  // namespace slsd
