// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/decode/decoding.hpp"
#include "core/result.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// Decodes the frames of one exposure into a cloud.
/// @param set     one frame for each of the setup's decoders
/// @param lane    selects the decoders; concurrent threads need different lanes
/// @errors kNotFound: no calibration; kMismatch: a frame's size differs from the calibration's; of encode_png()
/// @thread reentrant with different lanes
[[nodiscard]] Result<ScanResult> reconstruct(const FrameSet& set, ScanSetup& setup, std::size_t lane,
                                             const ScanRequest& request, const std::string& scan_id);

}  // namespace slsd
