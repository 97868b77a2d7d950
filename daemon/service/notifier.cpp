// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/notifier.hpp"

#include <systemd/sd-daemon.h>

namespace slsd {

void Notifier::starting(const std::string& status, std::chrono::microseconds time_max) const {
  sd_notifyf(0, "EXTEND_TIMEOUT_USEC=%lld\nSTATUS=%s", static_cast<long long>(time_max.count()), status.c_str());
}

void Notifier::ready(const std::string& status) const {
  if (stopping_) return;
  sd_notifyf(0, "READY=1\nSTATUS=%s", status.c_str());
}

void Notifier::status(const std::string& status) const {
  if (stopping_) return;
  sd_notifyf(0, "STATUS=%s", status.c_str());
}

void Notifier::reloading() const {
  if (stopping_) return;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%lld", static_cast<long long>(now_us));
}

void Notifier::stopping() {
  stopping_ = true;
  sd_notify(0, "STOPPING=1\nSTATUS=stopping");
}

void Notifier::ping_watchdog() const {
  sd_notify(0, "WATCHDOG=1");
}

std::optional<std::chrono::microseconds> Notifier::watchdog_time() {
  std::uint64_t time_us = 0;
  if (sd_watchdog_enabled(0, &time_us) <= 0) return std::nullopt;
  return std::chrono::microseconds(time_us);
}

}  // namespace slsd
