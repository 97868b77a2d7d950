// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>

#include "core/result.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// Ties a calibration to the projector and the cameras that it was made with. Compares them whenever a device was
/// opened or the setup replaced.
/// @thread thread-bound
class HardwareGuard {
 public:
  /// @param rig  its devices are open, the cameras in the setup's order
  /// @errors kMismatch: another device. If the configuration wants only a warning, logs that once instead
  [[nodiscard]] Result<> check(const std::shared_ptr<ScanSetup>& setup, const Rig& rig);

 private:
  std::weak_ptr<ScanSetup> setup_;  // the setup checked last; weak, so that a replaced setup can go
  std::uint64_t openings_ = 0;
  Result<> verdict_;
};

}  // namespace slsd
