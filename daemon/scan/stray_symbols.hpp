// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/decode/decoder.hpp"

namespace slsd {

/// The symbols of a frame that is full of them and gave hardly a point: so it is when the rig was knocked by more than
/// the decoder's tolerance. Only their pixels are known, and they are no part of a cloud.
/// @param full      the level of a saturated pixel of the frame
/// @param decoding  what the frame gave
/// @return          empty where the frame gave points, or does not show the pattern
/// @thread as the decoder
[[nodiscard]] std::vector<CloudPoint> stray_symbols(Decoder& decoder, const Decoding& decoding, const GreyView& frame,
                                                    double full);

}  // namespace slsd
