// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>

#include "core/result.hpp"
#include "daemon/scan/rig.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// Keeps a calibration to the projector and the cameras that it was made with: compares them as one was opened, or the
/// setup replaced.
/// @thread thread-bound
class HardwareGuard {
 public:
  /// @param rig  its devices are open, the cameras in the order of the setup's
  /// @errors kMismatch: another device, unless the configuration only wants a warning; that is logged once
  [[nodiscard]] Result<> check(const std::shared_ptr<ScanSetup>& setup, const Rig& rig);

 private:
  std::weak_ptr<ScanSetup> setup_;  // what was checked last; weak: a setup that a reload replaced may go
  std::uint64_t openings_ = 0;
  Result<> verdict_;
};

}  // namespace slsd
