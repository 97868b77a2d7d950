// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/hardware.hpp"

#include <algorithm>

#include "core/printable.hpp"

namespace slsd {

std::string projector_hardware(const std::string& model, const std::string& serial) {
  if (serial.empty()) return {};  // the model alone would also match other devices of its kind
  return printable(model.empty() ? serial : model + " " + serial);
}

void note_hardware(const RigStatus& rig, Calibration& calibration) {
  std::vector<std::string> serials;
  for (const DeviceStatus& camera : rig.cameras) serials.push_back(camera.hardware);
  const bool any = std::ranges::any_of(serials, [](const std::string& serial) { return !serial.empty(); });
  if (any) calibration.report.camera_serials = std::move(serials);
  if (!rig.projector.hardware.empty()) calibration.report.projector_serial = rig.projector.hardware;
}

Result<> check_hardware(const std::string& who, const std::string& calibrated, const std::string& connected) {
  if (calibrated.empty() || connected.empty() || calibrated == connected) return {};
  return fail(ErrorCode::kMismatch,
              "is \"" + connected + "\", but the calibration is for \"" + calibrated +
                  "\": connect that one, calibrate again, or set [calibration] other_hardware = \"warn\"",
              who);
}

Result<> check_hardware(const Calibration& calibration, const RigStatus& rig) {
  auto same = check_hardware("projector", calibration.report.projector_serial.value_or(""), rig.projector.hardware);
  for (const DeviceStatus& camera : rig.cameras) {
    const CalibratedCamera* const known = calibration.camera(camera.name);
    if (!same || known == nullptr) continue;
    same = check_hardware("camera " + camera.name, calibrated_hardware(calibration, *known), camera.hardware);
  }
  return same;
}

std::string calibrated_hardware(const Calibration& calibration, const CalibratedCamera& camera) {
  const auto index = static_cast<std::size_t>(&camera - calibration.cameras.data());
  const std::vector<std::string>& serials = calibration.report.camera_serials;
  return index < serials.size() ? serials[index] : std::string();
}

}  // namespace slsd
