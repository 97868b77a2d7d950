// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "daemon/scan/rig/device_status.hpp"

namespace slsd {

/// The identity of a projector from its EDID: maker and model with the serial number. Empty if the EDID does not
/// contain them. See CameraDescription::hardware.
[[nodiscard]] std::string projector_hardware(const std::string& model, const std::string& serial);

/// Records the devices that a calibration was made with, as far as they can be identified.
/// @param rig          all open; cameras in the calibration's order
/// @param calibration  receives the serial numbers in its report
void note_hardware(const RigStatus& rig, Calibration& calibration);

/// Checks that a device is the calibrated one. Accepts it if either identity is unknown.
/// @param who  the device's name in the message: "camera left"
/// @errors kMismatch: another device; the message says what to do
[[nodiscard]] Result<> check_hardware(const std::string& who, const std::string& calibrated,
                                      const std::string& connected);

/// Checks all devices of a scan. @param rig  all open
[[nodiscard]] Result<> check_hardware(const Calibration& calibration, const RigStatus& rig);

/// The hardware id of the calibrated device; empty if the file does not have one.
[[nodiscard]] std::string calibrated_hardware(const Calibration& calibration, const CalibratedCamera& camera);

}  // namespace slsd
