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

}  // namespace slsd
