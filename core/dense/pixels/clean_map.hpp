// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Removes impossible points from a map, judging by all its pixels together.
/// @thread thread-bound: keeps its buffers
class MapCleaner {
 public:
  /// Drops unlit pixels at boundaries: where the pattern is dark, a surface looks like a shadow. A pixel stays if firm
  /// ones enclose it, that is within their closing (dilation, then erosion by the same radius).
  void drop_unlit_boundaries(DenseMap& map, int reach_px, Executor& executor);
  /// Drops areas without a jump inside that have fewer pixels than a patch: so few are no evidence. An area without a
  /// seed needs far more pixels.
  void drop_small_components(DenseMap& map, std::size_t least, std::span<const SurfaceSeed> seeds, Executor& executor);
  /// Drops pixels closer than that to a hole or to a jump. Small holes inside one surface do not count.
  void prune(DenseMap& map, double reach_px, std::size_t hole_most, Executor& executor);
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

 private:
  /// A connected run of pixels in a row.
  struct Run {
    int y, first, end;
    std::int32_t parent;
    // Totals of the connected area, in its root:
    std::uint32_t pixels;
    bool borne = false;                                               // contains a seed
    float nearest = std::numeric_limits<float>::max(), farthest = 0;  // depth around a hole
  };
  [[nodiscard]] std::int32_t root(std::int32_t run);
  template <class First, class End, class Touch>
  void find_runs(int width, int height, const First& first, const End& end, const Touch& touch);
  void find_joined(const DenseMap& map, Executor& executor);
  void find_small_holes(const DenseMap& map, std::size_t most);

  std::vector<Run> runs_;
  std::vector<std::size_t> first_runs_;  // start of each row's runs, and the end of the last
  std::vector<std::uint64_t> bits_, rows_, measured_, right_, below_, holes_;
};

}  // namespace slsd
