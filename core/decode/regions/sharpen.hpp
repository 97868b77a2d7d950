// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/image.hpp"

namespace slsd {

/// Share of a pixel's noise that smoothing leaves.
inline constexpr float kSmoothedNoise = 0.375F;

/// Levels of a sharpened frame where the frame was saturated; above it is room for what its edges overshoot.
inline constexpr float kSharpenedFull = 50000;

/// Undoes blur of a known size as far as noise lets it: gaps between symbols are dark again, and shapes as they are in
/// a frame in focus. Symmetric in all directions, so that what is symmetric stays where it is.
///
/// By Wiener's filter along the rows and along the columns, W = T H / (H^2 + k^2): H the blur's spectrum, T that of the
/// blur which is left, k what noise may be of the light.
/// @thread thread-bound: keeps its buffers
class Sharpener {
 public:
  /// @param blur_px  one standard deviation
  /// @param full     the level of a saturated pixel of the frame
  /// @return         of the frame's size; stands until the next call
  const Grey16& sharpen(const GreyView& frame, float blur_px, double full);

  /// The opposite, for light that is faint in the noise: the mean over three rows and columns, weighted 1, 2, 1.
  const Grey16& smooth(const GreyView& frame, double full);

 private:
  template <class T>
  void filter(const ImageView<T>& frame, float scale);

  std::vector<float> weights_;  // of the filter, from its middle outwards
  std::vector<float> padded_, rows_, sum_;
  Grey16 filtered_;
};

}  // namespace slsd
