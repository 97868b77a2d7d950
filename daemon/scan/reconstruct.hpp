// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/decode/decoding.hpp"
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

/// The symbols of a frame that lie off their epipolar lines, where they are more than its points: so it is when the rig
/// was knocked by more than the decoder's tolerance. Only their pixels are known, and they are no part of a cloud.
/// @param camera  its index in the calibration
/// @return        empty where the frame gave points, or does not show the pattern
/// @thread reentrant
[[nodiscard]] std::vector<CloudPoint> stray_symbols(const Decoding& decoding, std::uint8_t camera);

}  // namespace slsd
