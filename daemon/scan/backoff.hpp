// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>

#include "daemon/configuration/scan_options.hpp"

namespace slsd {

/// The pauses between attempts to open a device: each twice as long as the one before, up to the longest.
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
