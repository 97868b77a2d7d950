// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// Merges the two exposures of each picture, and returns them to their drivers. Merged or not, every frame of such a
/// camera then has 16 bits and kMergedFull as the level of a saturated pixel, so a stream sees no change.
/// @return one for each camera with two exposures
/// @thread reentrant
[[nodiscard]] std::vector<MergedCamera> merge_frames(FrameSet& set, const ScanSetup& setup);

}  // namespace slsd
