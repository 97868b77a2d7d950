// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "daemon/scan/device_status.hpp"

namespace slsd {

/// The identity of a projector, from its EDID: maker and model with the serial number. Empty if the EDID does not tell.
/// See CameraDescription::hardware.
[[nodiscard]] std::string projector_hardware(const std::string& model, const std::string& serial);

/// Writes down what a calibration was made with, as far as it can be told.
/// @param rig          all open; the cameras in the order of the calibration's
/// @param calibration  gets the serials of its report
void note_hardware(const RigStatus& rig, Calibration& calibration);

/// Checks that a device is the one that was calibrated. If either is unknown, it is taken to be.
/// @param who  for the message: "camera left"
/// @errors kMismatch: it is another one; the message says what to do
[[nodiscard]] Result<> check_hardware(const std::string& who, const std::string& calibrated,
                                      const std::string& connected);

/// The same of all devices of a scan. @param rig  all open
[[nodiscard]] Result<> check_hardware(const Calibration& calibration, const RigStatus& rig);

/// The calibrated one's id; empty where the file does not say.
[[nodiscard]] std::string calibrated_hardware(const Calibration& calibration, const CalibratedCamera& camera);

}  // namespace slsd
