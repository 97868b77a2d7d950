// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// Calibrates from captures on disk, without hardware. Prints what each pose shows, the result and the verdict, and
/// keeps the calibration.
/// @errors of the configuration, the files, the board's text and calibrate(); kImpossible: the verdict is bad, or worse
///         than that in force, and no output was requested: the calibration in force stays
[[nodiscard]] Result<> calibrate_from_files(const CalibrateRequest& request);

}  // namespace slsd
