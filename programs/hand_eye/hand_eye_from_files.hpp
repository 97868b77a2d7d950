// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "clients/usage/hand_eye_usage.hpp"
#include "core/result.hpp"

namespace slsd {

/// Calibrates a scanner's place in a robot cell from captures and poses.csv, and writes the hand-eye file. Writes
/// nothing if it finds a fault.
/// @errors of the configuration, the files and diagnose_hand_eye(); kMismatch: a fault, which the message names
[[nodiscard]] Result<> hand_eye_from_files(const HandEyeRequest& request);

/// First takes a view with the service's devices, for the robot's pose of the request if it has one, and adds it to the
/// folder. Then does the same with the service's calibration, but too few poses and too little motion are no errors: it
/// tells the next pose. After an error the folder's views are as they were.
/// @errors of the service, take_view() and hand_eye_from_files(); kNotFound: the new picture does not show the board
[[nodiscard]] Result<> hand_eye_by_socket(const HandEyeRequest& request);

}  // namespace slsd
