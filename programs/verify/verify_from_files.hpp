// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Checks the calibration in force with captures of a board or a plain plane, without hardware, and reports whether it
/// holds.
/// @param request  its folder, board and ruler; the configuration names the calibration
/// @errors of the configuration and the files; those of Verifier
[[nodiscard]] Result<> verify_from_files(const CalibrateRequest& request);

}  // namespace slsd
