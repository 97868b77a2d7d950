// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Carries out slsd --calibrate. Takes poses with the configured devices until there are enough or a signal comes,
/// stores them, calibrates, and keeps the calibration. The service must not run, because it owns the devices.
/// @errors of the configuration, the board, the devices, the files and calibrate(); kInvalidArgument: the number of
///         poses; kCancelled: interrupted with too few poses. On errors, the calibration in force stays
/// @thread the projector's: main
[[nodiscard]] Result<> calibrate_by_session(const CalibrateRequest& request);

}  // namespace slsd
