// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>

#include "core/result.hpp"
#include "daemon/scan/frame_set.hpp"
#include "daemon/scan/scan_result.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// Decodes the frames of one exposure into one cloud.
/// @param set     one frame to each of the setup's decoders
/// @param lane    whose decoders are used: two threads at once take two lanes
/// @errors kNotFound: no calibration; kMismatch: a frame of another size than the calibration's; of picture_of()
/// @thread reentrant with different lanes
[[nodiscard]] Result<ScanResult> reconstruct(const FrameSet& set, ScanSetup& setup, std::size_t lane,
                                             const ScanRequest& request, const std::string& scan_id);

}  // namespace slsd
