// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// slsd --calibrate: takes poses with the configured projector and cameras until there are enough or a signal comes,
/// records them, calibrates, and keeps the calibration. The service must not run, as it owns the devices.
/// @errors of the configuration, the board, the devices, the files and calibrate(); kInvalidArgument: the number of
///         poses; kCancelled: it was ended with too few poses. The calibration in force stays as it is
/// @thread that of the projector: main
[[nodiscard]] Result<> calibrate_by_session(const CalibrateRequest& request);

}  // namespace slsd
