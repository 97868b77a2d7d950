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
  double projector_latency_ms =
      0.0;                ///< 0 to 1000; from an image that the projector shows to a frame that has it whole
  int power_line_hz = 0;  ///< 50 or 60, of the lamps around, which flicker with it; 0: none, or not known

  [[nodiscard]] std::chrono::milliseconds timeout() const { return std::chrono::milliseconds(timeout_ms); }
  [[nodiscard]] std::chrono::microseconds projector_latency() const {
    return std::chrono::ceil<std::chrono::microseconds>(
        std::chrono::duration<double, std::milli>(projector_latency_ms));
  }
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ScanOptions&, const ScanOptions&) = default;
};

}  // namespace slsd
