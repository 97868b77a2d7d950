// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>

#include "core/image.hpp"

namespace slsd {

/// The noise of a frame's pixels: the sensor's own, and photon noise, whose variance grows with the light.
struct FrameNoise {
  float dark_variance = 0;       ///< grey levels squared
  float variance_per_level = 0;  ///< grey levels

  /// One standard deviation of a pixel, grey levels.
  [[nodiscard]] __attribute__((always_inline)) float at(float level) const {
    return std::sqrt(dark_variance + variance_per_level * (level > 0 ? level : 0));
  }
  /// Scales to a frame with so many levels per level of this frame, and with this share of the noise.
  [[nodiscard]] FrameNoise scaled(float levels, float share = 1) const {
    return {dark_variance * levels * levels * share * share, variance_per_level * levels * share * share};
  }
};

/// Measures the noise of a frame from second differences along the rows, at a sample of pixels. For each grey level it
/// uses the places that the rows above and below show to be flattest, because small symbols are hardly flat anywhere.
/// For levels that occur only at edges, the levels with less noise decide.
/// @param full  the level of a saturated pixel, which has no noise
/// @thread reentrant
[[nodiscard]] FrameNoise measure_noise(const GreyView& frame, double full);

}  // namespace slsd
