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

/// Keeps a DriftWatch for each configured camera and logs each change of its verdict. Every setup starts new watches.
/// @thread thread-safe
class CalibrationWatch {
 public:
  /// @param setup  the setup that decoded the scan
  /// @param scan   the scan's number
  void note(const SharedSetup& setup, const ScanResult& result, std::uint64_t scan);

  /// The drift of each configured camera; empty before the first scan.
  [[nodiscard]] std::vector<DriftState> states() const;

 private:
  struct Watched {
    std::string name;
    std::uint8_t index;  // index of the camera in the calibration
    DriftWatch watch;
  };
  void begin(const SharedSetup& setup);

  mutable std::mutex mutex_;
  std::weak_ptr<ScanSetup> setup_;  // the setup whose scans are watched; weak, so that a replaced setup can go
  std::vector<Watched> cameras_;
};

}  // namespace slsd
