// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/hardware_guard.hpp"

#include <spdlog/spdlog.h>

#include "daemon/scan/hardware.hpp"

namespace slsd {
namespace {

Result<> compare(const ScanSetup& setup, const std::vector<DeviceStatus>& cameras) {
  if (!setup.calibration) return {};
  for (const DeviceStatus& camera : cameras) {
    const CalibratedCamera* const known = setup.calibration->camera(camera.name);
    if (known == nullptr) continue;
    auto same = check_hardware("camera " + camera.name, calibrated_hardware(*setup.calibration, *known),
                               hardware_id(camera.driver, camera.device));
    if (!same) return same;
  }
  return {};
}

}  // namespace

Result<> HardwareGuard::check(const std::shared_ptr<ScanSetup>& setup, const Rig& rig) {
  const std::uint64_t openings = rig.camera_openings();
  if (setup_.lock() == setup && openings == openings_) return verdict_;
  setup_ = setup, openings_ = openings;
  verdict_ = compare(*setup, rig.camera_statuses());
  if (!verdict_ && setup->other_hardware == OtherHardware::kWarn) {
    spdlog::warn("{}", to_string(verdict_.error()));
    verdict_ = {};
  }
  return verdict_;
}

}  // namespace slsd
