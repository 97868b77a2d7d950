// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/dense/dense_map.hpp"
#include "core/dense/executor.hpp"
#include "core/dense/ray_grid.hpp"
#include "core/dense/surface_grid.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Takes out of a map what cannot be, by what all its pixels say together.
/// @thread thread-bound: keeps its buffers
class MapCleaner {
 public:
  MapCleaner(const CalibratedCamera& camera, const Lens& projector, std::shared_ptr<const RayGrid> rays);

  /// A projector pixel lights one point: what lies behind another surface on its ray goes.
  void drop_occluded(DenseMap& map, Executor& executor);
  /// Where the pattern is dark, a surface looks like a shadow: such a pixel stays where firm ones enclose it, which is
  /// within their closing (dilated, then eroded as much), and goes at a rim.
  void drop_unlit_rims(DenseMap& map, int reach_px);
  /// What hangs together without a jump, and has fewer pixels than a patch, goes: so little can be anything. What bears
  /// none of the seeds goes unless it has far more.
  void drop_islands(DenseMap& map, std::size_t least, std::span<const SurfaceSeed> seeds);
  /// What is nearer than that to a hole or to a jump goes.
  void prune(DenseMap& map, double reach_px);
  [[nodiscard]] std::size_t bytes() const;  ///< what it holds of memory

 private:
  CalibratedCamera camera_;
  Lens projector_;
  std::shared_ptr<const RayGrid> rays_;  // shared: the same for all
  /// Pixels of a row that hang together.
  struct Run {
    int y, first, end;
    std::int32_t parent;
    std::uint32_t pixels;  ///< of all that hang together, in the root
    bool borne;            ///< by a seed, as well
  };
  void find_joined(const DenseMap& map);

  std::vector<std::int32_t> label_;
  std::vector<Run> runs_;
  std::vector<std::size_t> first_runs_;  // of each row, and the end of the last
  std::vector<std::uint64_t> bits_, rows_, measured_, right_, below_;
  std::vector<float> distance_, nearest_;
};

}  // namespace slsd
