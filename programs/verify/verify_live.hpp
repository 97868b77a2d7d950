// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Takes one view of a board or a plain plane with the configured devices, and reports whether the calibration in force
/// holds. The service must be stopped, because it owns the devices.
/// @param request  its board and ruler
/// @errors of the configuration and the devices; those of Verifier
[[nodiscard]] Result<> verify_live(const CalibrateRequest& request);

}  // namespace slsd
