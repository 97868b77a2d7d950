// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/decode/decoding.hpp"

namespace slsd {

/// The symbols of a frame that lie off their epipolar lines, where they are more than its points: so it is when the rig
/// was knocked by more than the decoder's tolerance. Only their pixels are known, and they are no part of a cloud.
/// @param camera  its index in the calibration
/// @return        empty where the frame gave points, or does not show the pattern
/// @thread reentrant
[[nodiscard]] std::vector<CloudPoint> stray_symbols(const Decoding& decoding, std::uint8_t camera);

}  // namespace slsd
