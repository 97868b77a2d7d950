// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/decode/grid/lattice_frame.hpp"
#include "core/decode/symbols/weigh_patch.hpp"
#include "core/image.hpp"
#include "core/regions/find_regions.hpp"

namespace slsd {

/// Moments of a region's grey values through a soft threshold. It is a ramp from 10 to 30 % of the way from the
/// region's own background to its own peak. The centre uses a ramp from 20 to 80 %, or to 65 % in uneven light. A pixel
/// on the edge counts by its lit share. The centre is therefore good to some hundredths of a pixel; the binary mask's
/// is eight times worse.
struct GreyMoments {
  float x = 0, y = 0;                        ///< centre, camera px
  float steady_x = 0, steady_y = 0;          ///< centre with less pull from uneven light and more noise; only if
                                             ///< measured
  float weight = 0;                          ///< lit area, camera px squared
  float m20 = 0, m11 = 0, m02 = 0;           ///< about the centroid, over the weight: px^2
  float m30 = 0, m21 = 0, m12 = 0, m03 = 0;  ///< px^3
  float background = 0, peak = 0;            ///< grey levels of the frame
};

/// Columns of each patch row between which pixels belong to the region or its margin.
struct PatchEdges {
  const std::int16_t *before, *after;
};

/// Measures regions.
/// @thread thread-bound: keeps its buffers
class GreyMomentMeter {
 public:
  /// @param margin_px  distance beyond the mask to which the region's blurred edge is followed; less than the gap to
  ///                   its neighbours
  /// @param patch_px   side of a patch for which buffers are allocated
  explicit GreyMomentMeter(int margin_px, float patch_px = 0);
  /// Makes a meter for another worker.
  [[nodiscard]] GreyMomentMeter another() const { return GreyMomentMeter(margin_px_, patch_px_); }

  template <class T>
  [[nodiscard]] GreyMoments measure(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                    SteadyCentre steady = SteadyCentre::kLeftOut);
  /// Measures several of a frame's regions at once, which is faster than one by one.
  /// @param moments  one for each region, in order
  template <class T>
  void measure_all(const ImageView<T>& frame, const Regions& regions, std::span<const std::int32_t> which,
                   std::span<GreyMoments> moments);
  /// Measures the moments with the steady centre.
  /// @param shading  relative change of the light for one camera px, removed about the centre of the region's box
  template <class T>
  [[nodiscard]] GreyMoments measure_levelled(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                             const Eigen::Vector2f& shading);

  /// Measures a cell of the grid, whatever its mask, with the light levelled and with the steady centre.
  /// @param centre_px    centre of the symbol's square, in the camera
  /// @param half_px      distance from the centre to the side of the cell, projector px
  /// @param shading      relative change of the light for one camera px, from the centre
  template <class T>
  [[nodiscard]] GreyMoments measure_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px,
                                         const LatticeFrame& lattice_frame, float half_px,
                                         const Eigen::Vector2f& shading);

 private:
  /// Tells whether the patch lies in the frame, padding included.
  template <class T>
  [[nodiscard]] bool lies_in(const ImageView<T>& frame) const {
    return left_ >= 0 && top_ >= 0 && left_ + stride_ <= frame.width && top_ + height_ <= frame.height;
  }
  [[nodiscard]] PatchEdges follow_edge(const Region& region, std::span<const Run> runs);
  template <class T>
  void copy_patch(const ImageView<T>& frame, const Region& region, std::span<const Run> runs);
  template <class T>
  void copy_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px, const LatticeFrame& lattice_frame,
                 float half_px);
  void level_light(const Eigen::Vector2f& centre_px, const Eigen::Vector2f& shading);
  [[nodiscard]] GreyMoments moments_of_patch();

  int margin_px_;
  float patch_px_;
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0, stride_ = 0;  // box and stride of the patch
  std::vector<std::int16_t> edges_;
  std::vector<float> patch_;  // grey values; kOutside for pixels of others
  PatchRange range_;          // range of the patch
  std::vector<RowPowers> rows_;
};

}  // namespace slsd
