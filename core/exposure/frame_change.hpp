// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"

namespace slsd {

/// Changes between two frames of a scene that should have stayed.
struct FrameChange {
  double noise = 0;        ///< one standard deviation of a pixel, where nothing moved
  double moved_share = 0;  ///< share of the tiles, 64 px wide, that changed beyond noise; 0 to 1
  double brighter = 1;     ///< brightness of the second over the first, over the whole frame

  /// Difference between the brightness of both, as a share. @return 0 and more
  [[nodiscard]] double flicker() const { return brighter > 1 ? brighter - 1 : 1 / brighter - 1; }
};

/// Compares two frames. A replayed image compared with itself has no noise.
/// @param first, second  of the same size and depth, taken one after the other while the pattern was shown
/// @return               nothing changed, where their sizes or depths differ
/// @thread reentrant
[[nodiscard]] FrameChange compare_frames(const GreyView& first, const GreyView& second);

}  // namespace slsd
