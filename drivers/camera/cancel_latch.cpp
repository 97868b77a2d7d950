// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/cancel_latch.hpp"

#include <utility>

namespace slsd {

bool CancelLatch::wait_until(MonotonicTime time) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, time, [this] { return cancelled_; });
  return std::exchange(cancelled_, false);
}

void CancelLatch::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

void CancelLatch::reset() {
  const std::lock_guard lock(mutex_);
  cancelled_ = false;
}

}  // namespace slsd
