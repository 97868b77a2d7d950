// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/decode/decoding.hpp"

namespace slsd {

/// Finds a frame's symbols off their epipolar lines, if they outnumber its points. That happens when the rig was
/// knocked out of the decoder's tolerance. Only their pixels are known; no cloud contains them.
/// @param camera  index in the calibration
/// @return        empty if the frame gave points, or does not show the pattern
/// @thread reentrant
[[nodiscard]] std::vector<CloudPoint> stray_symbols(const Decoding& decoding, std::uint8_t camera);

}  // namespace slsd
