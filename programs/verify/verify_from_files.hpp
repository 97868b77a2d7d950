// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Looks at captures of a board or of a plain plane by the calibration in force, without any hardware, and says whether
/// it holds.
/// @param request  its folder, board and ruler; the configuration names the calibration
/// @errors of the configuration and the files; what Verifier says
[[nodiscard]] Result<> verify_from_files(const CalibrateRequest& request);

}  // namespace slsd
