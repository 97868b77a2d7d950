// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/exposure/frame_change.hpp"
#include "core/image.hpp"

namespace slsd {

/// Noise of the pixels near one grey level.
struct LevelNoise {
  double level = 0;     ///< their mean
  double variance = 0;  ///< grey levels squared, without that of rounding
  std::int64_t pixels = 0;
};

/// Noise that differs between two frames of a still scene.
struct NoiseBetween {
  std::vector<LevelNoise> levels = {};  ///< darkest first; without levels that too few pixels have
  /// Correlation of the noise of neighbouring pixels: 0 on a plain sensor, near 1 for coarse grain. Empty if there is
  /// hardly any noise beyond rounding.
  std::optional<double> neighbours = {};
};

/// Measures the noise at each grey level. It uses the flattest pixels of each level in tiles without motion, since a
/// tremble of a tenth of a pixel changes the others more than noise does.
/// @param change  between the two frames, by compare_frames()
/// @param full    the level of a saturated pixel, whose noise does not count
/// @return        nothing if the frames differ in size or depth
/// @thread        reentrant
[[nodiscard]] NoiseBetween noise_between(const GreyView& first, const GreyView& second, const FrameChange& change,
                                         double full);

}  // namespace slsd
