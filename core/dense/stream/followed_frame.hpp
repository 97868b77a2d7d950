// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/appearance/blurred_pattern.hpp"
#include "core/appearance/patch_map.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/executor.hpp"

namespace slsd {

/// A frame with measured nodes, and the data that continues it in frames with small differences.
struct FollowedFrame {
  std::vector<std::uint16_t> pixels;
  double full = 0;
  float tone_power = 1;    ///< see DenseFrame
  BlurredPattern pattern;  ///< what the nodes were aligned with
  EpipolarOffset epipolar;
  std::vector<SurfaceNode> nodes;                  ///< good if they gave points
  std::vector<char> tried;                         ///< nodes that no plane fitted
  std::size_t good = 0, good_sampled = 0;          ///< numbers of good nodes: all, and in the sampled rows
  std::vector<SurfaceSeed> found;                  ///< see SurfaceSearch
  std::vector<std::int16_t> along, across, light;  ///< for each pixel: the derivatives of the light, and the light
  float slope_unit = 0;                            ///< slope of one unit of the derivatives
  std::vector<float> inverses;                     ///< N^-1 of each node: its upper triangle, row by row

  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

  /// Finds `along`, `across` and `light` from the nodes and the pattern.
  void find_derivatives(const SurfaceGrid& grid, Executor& executor);
  /// Finds `inverses` from these.
  void find_inverses(const DenseFrame& frame, const SurfaceGrid& grid, int window_px, Executor& executor);

  /// The size of an upper triangle; and the light of one unit.
  static constexpr int kPacked = kFitted * (kFitted + 1) / 2;
  static constexpr float kLightUnit = 1.F / 16384;
};

/// Tells whether a window around this place lies within the frame.
inline bool within(int middle, int half, int size) {
  return middle >= half && middle + half < size;
}

}  // namespace slsd
