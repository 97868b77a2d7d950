// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <mutex>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// A sleep that another thread can end. A cancel() that meets nobody asleep ends the next sleep.
/// @thread thread-safe
class CancelLatch {
 public:
  /// Sleeps until the time, or until cancelled: then true, and the latch is reset. A time in the past looks only.
  [[nodiscard]] bool wait_until(MonotonicTime time);

  void cancel();
  void reset();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool cancelled_ = false;
};

}  // namespace slsd
