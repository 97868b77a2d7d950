// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/dense/dense_mapper.hpp"
#include "core/image.hpp"

namespace slsd {

/// A part of the frame, to be looked at.
struct FramePart {
  int left, top, width, height;
};

/// What each step of a dense cloud makes of a part of the last frame, side by side: the symbols that growth begins at,
/// the planes that were grown, what became of each pixel, its depth, its relief, its sigma.
/// @param mapper  that has just measured the frame
[[nodiscard]] ColourImage draw_dense_steps(const GreyView& frame, const DenseMapper& mapper, const DenseMap& map,
                                           const FramePart& part);

}  // namespace slsd
