// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/decode/find_regions.hpp"
#include "core/image.hpp"

namespace slsd {

/// What a region weighs: moments of its grey values through a soft threshold, a ramp from 20 to 80 % of the way from
/// the region's own background to its own peak. A pixel on the edge counts by how much of it is lit, so the centre is
/// good to some hundredths of a pixel, where the binary mask's is eight times worse.
struct GreyMoments {
  float x = 0, y = 0;                        ///< centroid, camera px
  float weight = 0;                          ///< lit area, camera px squared
  float m20 = 0, m11 = 0, m02 = 0;           ///< central, over the weight: px^2
  float m30 = 0, m21 = 0, m12 = 0, m03 = 0;  ///< px^3
  float background = 0, peak = 0;            ///< grey levels of the frame
};

/// Measures regions one by one.
/// @thread thread-bound: keeps its buffers
class GreyMomentMeter {
 public:
  /// @param margin_px  how far beyond the mask a region's blurred edge is followed; less than the gap to its neighbours
  explicit GreyMomentMeter(int margin_px) : margin_px_(margin_px) {}

  /// @param shading  how the light falls off over the region: relative change for one camera px, about its box's middle
  template <class T>
  [[nodiscard]] GreyMoments measure(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                    const Eigen::Vector2f& shading = Eigen::Vector2f::Zero());

 private:
  template <class T>
  void copy_patch(const ImageView<T>& frame, const Region& region, std::span<const Run> runs);

  void level_light(const Eigen::Vector2f& shading);

  int margin_px_;
  int width_ = 0, height_ = 0;
  std::vector<int> first_, last_;  // extent of the region in each row of the patch
  std::vector<float> patch_;       // grey values; kOutside where they belong to others
};

}  // namespace slsd
