// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// The frame as a dim grey background, stretched so that bright parts look alike in every frame.
/// @param scale   1 or more: each pixel becomes scale x scale
/// @param footer_px  rows of empty background below
[[nodiscard]] ColourImage dimmed_frame(const GreyView& frame, int scale, int footer_px);

}  // namespace slsd
