// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>

#include "core/result.hpp"

namespace slsd {

inline constexpr int kMaxTimeoutMs = 600'000;

/// The [scan] table.
struct ScanOptions {
  int timeout_ms = 5000;         ///< 1 to 600000; how long a scan waits for devices and frames unless the client says
  int exposure_skew_ms = 100;    ///< 0 to 10000; how far apart the exposures of a scan's cameras may begin
  int reopen_first_ms = 100;     ///< 1 to 60000; pause before a device that failed is opened again; doubles each time
  int reopen_longest_ms = 1000;  ///< the longest such pause

  [[nodiscard]] std::chrono::milliseconds timeout() const { return std::chrono::milliseconds(timeout_ms); }
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ScanOptions&, const ScanOptions&) = default;
};

}  // namespace slsd
