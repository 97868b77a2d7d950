// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Takes one look with the configured projector and cameras, at a board or a plain plane, and says whether the
/// calibration in force holds. The devices must be free: the service stopped.
/// @param request  its board and ruler
/// @errors of the configuration and the devices; what Verifier says
[[nodiscard]] Result<> verify_live(const CalibrateRequest& request);

}  // namespace slsd
