// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/duration.hpp"
#include "core/result.hpp"
#include "daemon/scan/cloud/scan_result.hpp"

namespace slsd {

/// The totals of all scans since the start.
struct ScanTotals {
  std::uint64_t succeeded = 0;
  std::map<ErrorCode, std::uint64_t> failed;
  std::optional<Error> last_error;
  std::uint64_t points = 0;      ///< points of the last scan
  std::string empty;             ///< why the last scan's cloud was empty; empty: it had points
  std::uint64_t all_points = 0;  ///< points of symbols in all scans
  std::uint64_t lost_tries = 0;  ///< failed tries of scans that then succeeded
  std::array<std::uint64_t, kRegionStatusCount> regions{};
  RegionCounts regions_of_last{};
  std::array<std::uint64_t, kDecodeRuleCount> rules{};
  RuleCounts rules_of_last{};
  std::vector<CameraLight> light;  ///< of the last scan that measured it
  std::uint64_t skipped = 0;       ///< sets of frames in free run that were skipped for newer ones
  Duration capture;
  Duration decode;
  Duration latency;  ///< time from the last byte of a scan's frames to its cloud at a client's socket
  std::array<Duration, kStageCount> stages{};
  Duration dense;  ///< time for the points of pixels, in scans that have them
  std::array<std::uint64_t, kDensePixelCount> pixels{};
};

/// Counts scans. @thread thread-safe
class ScanStatistics {
 public:
  /// @param skipped  sets of frames since the previous scan
  void note(const Result<ScanResult>& scan, std::uint64_t skipped);
  void note_latency(std::chrono::nanoseconds time);
  [[nodiscard]] ScanTotals totals() const;

 private:
  mutable std::mutex mutex_;
  ScanTotals totals_;
};

}  // namespace slsd
