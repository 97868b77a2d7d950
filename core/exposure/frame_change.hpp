// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/image.hpp"

namespace slsd {

struct PixelPlace {
  int x = 0, y = 0;
};

/// Changes between two frames of a scene that should be static.
struct FrameChange {
  double noise = 0;        ///< one standard deviation of a pixel, in tiles without motion
  double moved_share = 0;  ///< share of the tiles, 64 px wide, that changed beyond noise; 0 to 1
  double brighter = 1;     ///< ratio of the second frame's brightness to the first's
  double bands = 0;        ///< median over the rows: how much more than the frame a row's brightness changed; relative
  std::vector<PixelPlace> still = {};  ///< first pixels of the tiles that surely did not change beyond noise

  /// Relative difference between both brightnesses. @return at least 0
  [[nodiscard]] double flicker() const { return brighter > 1 ? brighter - 1 : 1 / brighter - 1; }
};

/// Compares two frames. A replayed image compared with itself has no noise.
/// @param first, second  of the same size and depth, taken one after the other while the pattern was shown
/// @return               no change if their sizes or depths differ
/// @thread reentrant
[[nodiscard]] FrameChange compare_frames(const GreyView& first, const GreyView& second);

}  // namespace slsd
