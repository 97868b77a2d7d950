// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/image.hpp"

namespace slsd {

/// Share of a pixel's noise that remains after smoothing.
inline constexpr float kSmoothedNoise = 0.375F;

/// Level of a saturated pixel in a sharpened frame; the range above it holds overshoot at edges.
inline constexpr float kSharpenedFull = 50000;

/// Undoes a known blur as far as noise allows: gaps between symbols become dark again, and shapes look as in a frame in
/// focus. The filter is symmetric in all directions, so symmetric shapes keep their place.
///
/// Wiener's filter along rows and columns, W = T H / (H^2 + k^2): H is the spectrum of the blur, T that of the
/// remaining blur, and k the allowed noise as a share of the light.
/// @thread thread-bound: keeps its buffers
class Sharpener {
 public:
  /// @param blur_px  one standard deviation
  /// @param full     the level of a saturated pixel of the frame
  /// @return         of the frame's size; valid until the next call
  const Grey16& sharpen(const GreyView& frame, float blur_px, double full);

  /// The opposite of sharpening, for light that is faint in the noise: the mean over three rows and columns, weighted
  /// 1, 2, 1.
  const Grey16& smooth(const GreyView& frame, double full);

 private:
  template <class T>
  void filter(const ImageView<T>& frame, float scale);

  std::vector<float> weights_;  // the filter's weights, from its middle outwards
  std::vector<float> padded_, rows_, sum_;
  Grey16 filtered_;
};

}  // namespace slsd
