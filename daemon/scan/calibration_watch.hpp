// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/calibrate/watch/drift_watch.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// A DriftWatch to each configured camera, begun anew with each setup, and a line in the log as one changes its mind.
/// @thread thread-safe
class CalibrationWatch {
 public:
  /// @param setup  that the scan was decoded by
  /// @param scan   its number
  void note(const SharedSetup& setup, const ScanResult& result, std::uint64_t scan);

  /// One to a configured camera; empty before the first scan.
  [[nodiscard]] std::vector<DriftState> states() const;

 private:
  struct Watched {
    std::string name;
    std::uint8_t index;  // in the calibration
    DriftWatch watch;
  };
  void begin(const SharedSetup& setup);

  mutable std::mutex mutex_;
  std::weak_ptr<ScanSetup> setup_;  // whose scans are watched; weak: a setup that a reload replaced may go
  std::vector<Watched> cameras_;
};

}  // namespace slsd
