// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/dense/dense_map.hpp"
#include "core/dense/ray_grid.hpp"
#include "core/dense/surface_grid.hpp"
#include "core/executor.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Takes out of a map what cannot be, by what all its pixels say together.
/// @thread thread-bound: keeps its buffers
class MapCleaner {
 public:
  MapCleaner(const CalibratedCamera& camera, const Lens& projector, std::shared_ptr<const RayGrid> rays);

  /// A projector pixel lights one point: what lies behind another surface on its ray goes.
  void drop_occluded(DenseMap& map, Executor& executor);
  /// What the projector's image does not reach goes: it is no edge, so this comes last. Of the map that drop_occluded()
  /// has seen.
  void drop_beyond_the_light(DenseMap& map);
  /// Where the pattern is dark, a surface looks like a shadow: such a pixel stays where firm ones enclose it, which is
  /// within their closing (dilated, then eroded as much), and goes at a rim.
  void drop_unlit_rims(DenseMap& map, int reach_px);
  /// What hangs together without a jump, and has fewer pixels than a patch, goes: so little can be anything. What bears
  /// none of the seeds goes unless it has far more.
  void drop_islands(DenseMap& map, std::size_t least, std::span<const SurfaceSeed> seeds);
  /// What is nearer than that to a hole or to a jump goes; but for holes of so few pixels that one surface is all
  /// around.
  void prune(DenseMap& map, double reach_px, std::size_t hole_most);
  [[nodiscard]] std::size_t bytes() const;  ///< what it holds of memory

 private:
  CalibratedCamera camera_;
  Lens projector_;
  std::shared_ptr<const RayGrid> rays_;  // shared: the same for all
  /// Pixels of a row that hang together.
  struct Run {
    int y, first, end;
    std::int32_t parent;
    // Of all that hang together, in the root:
    std::uint32_t pixels;
    bool borne = false;                                               // by a seed
    float nearest = std::numeric_limits<float>::max(), farthest = 0;  // depth around a hole
  };
  [[nodiscard]] std::int32_t root(std::int32_t run);
  template <class First, class End, class Touch>
  void find_runs(int width, int height, const First& first, const End& end, const Touch& touch);
  void find_joined(const DenseMap& map);
  void find_small_holes(const DenseMap& map, std::size_t most);

  std::vector<std::int32_t> label_;
  std::vector<Run> runs_;
  std::vector<std::size_t> first_runs_;  // of each row, and the end of the last
  std::vector<std::uint64_t> bits_, rows_, measured_, right_, below_, holes_;
  std::vector<float> distance_, nearest_;
};

}  // namespace slsd
