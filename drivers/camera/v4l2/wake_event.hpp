// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// A cancel() that ends a wait on a device. One that meets nobody waiting ends the next wait.
/// @thread thread-safe
class WakeEvent {
 public:
  enum class Woken { kReady, kGone, kCancelled, kLate };

  WakeEvent();
  ~WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  /// Waits until the device has something to read, or fails (kGone).
  [[nodiscard]] Woken wait(int device, MonotonicTime deadline) const;

  void cancel() const;
  void reset() const;

 private:
  int event_;
};

}  // namespace slsd
