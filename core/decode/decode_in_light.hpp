// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/cloud/shade_points.hpp"
#include "core/decode/decoder.hpp"

namespace slsd {

/// Decodes a frame, or where there is one in white light too, what is left when that is divided out: print and wood
/// have edges of their own, which then do not count. Where the scene has moved between the two, and the frame by itself
/// gives more points, these: white light costs no point.
/// @errors as Decoder::decode(); kMismatch: the frames are not of one size
/// @thread thread-bound, as the decoder
[[nodiscard]] Result<const Decoding*> decode_in_light(Decoder& decoder, const GreyView& frame, const SceneLight& light,
                                                      StageObserver* observer = nullptr, Executor* executor = nullptr);

}  // namespace slsd
