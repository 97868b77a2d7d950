// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>

#include "core/result.hpp"
#include "daemon/scan/scan_result.hpp"

namespace slsd {

/// How long something took: the last time, on average, and at most.
struct Duration {
  std::chrono::nanoseconds last{};
  std::chrono::nanoseconds total{};
  std::chrono::nanoseconds longest{};
  std::uint64_t count = 0;

  void add(std::chrono::nanoseconds time);
  [[nodiscard]] std::chrono::nanoseconds mean() const {
    return count == 0 ? total : total / static_cast<std::int64_t>(count);
  }
};

/// What all scans since the start came to.
struct ScanTotals {
  std::uint64_t succeeded = 0;
  std::map<ErrorCode, std::uint64_t> failed;
  std::optional<Error> last_error;
  std::uint64_t points = 0;  ///< of the last scan
  std::array<std::uint64_t, kRegionStatusCount> regions{};
  RegionCounts regions_of_last{};
  std::uint64_t skipped = 0;  ///< sets of frames taken in free run and not decoded: newer ones came
  Duration capture;
  Duration decode;
  Duration latency;  ///< from the last byte of a scan's frames to its cloud at a client's socket
  std::array<Duration, kStageCount> stages{};
};

/// Counts scans. @thread thread-safe
class ScanStatistics {
 public:
  /// @param skipped  sets of frames since the scan before
  void note(const Result<ScanResult>& scan, std::uint64_t skipped);
  void note_latency(std::chrono::nanoseconds time);
  [[nodiscard]] ScanTotals totals() const;

 private:
  mutable std::mutex mutex_;
  ScanTotals totals_;
};

}  // namespace slsd
