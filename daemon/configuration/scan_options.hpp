// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>

#include "core/result.hpp"

namespace slsd {

inline constexpr int kMaxTimeoutMs = 600'000;

/// The [scan] table.
struct ScanOptions {
  int timeout_ms = 5000;              ///< 1 to 600000; a scan's wait for devices and frames unless the client sets it
  int exposure_skew_ms = 100;         ///< 0 to 10000; the greatest difference between the starts of a scan's exposures
  int reopen_first_ms = 100;          ///< 1 to 60000; the pause before a failed device is reopened; doubles each time
  int reopen_longest_ms = 1000;       ///< the greatest such pause
  double projector_latency_ms = 0.0;  ///< 0 to 1000; from showing an image to a frame with the whole image
  int power_line_hz = 0;              ///< 50 or 60: mains frequency of the flickering lamps around; 0: none, or unknown

  [[nodiscard]] std::chrono::milliseconds timeout() const { return std::chrono::milliseconds(timeout_ms); }
  /// The time in which each camera adopts another exposure or gain: as long as a scan may wait, and enough to reopen
  /// it.
  [[nodiscard]] std::chrono::milliseconds camera_settings_time() const {
    return std::max<std::chrono::milliseconds>(timeout(), std::chrono::seconds(20));
  }
  [[nodiscard]] std::chrono::microseconds projector_latency() const {
    return std::chrono::ceil<std::chrono::microseconds>(
        std::chrono::duration<double, std::milli>(projector_latency_ms));
  }
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ScanOptions&, const ScanOptions&) = default;
};

}  // namespace slsd
