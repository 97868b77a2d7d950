// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/ray_grid.hpp"
#include "core/executor.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {

/// Removes points that no light of the projector reaches. Projects tiles of the map first, as boxes in the projector's
/// image. Only tiles in a box with two surfaces, or near the image's border, are projected pixel by pixel.
/// @thread thread-bound: keeps its buffers
class Occlusion {
 public:
  Occlusion(const CalibratedCamera& camera, const Lens& projector, std::shared_ptr<const RayGrid> rays);

  /// Drops points that lie behind another surface on their projector ray: a projector pixel lights one point only.
  void drop_occluded(DenseMap& map, Executor& executor);
  /// Drops points outside the projector's image. These drops make no edges, so this comes last. Needs the map that
  /// drop_occluded() has seen.
  void drop_beyond_the_light(DenseMap& map) const;
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

 private:
  /// A square of the map, and the cells of the projector's image that its points may lie in.
  struct Tile {
    std::int32_t left = 0, top = 0, right = -1, bottom = -1;  // inclusive
    float nearest = 0, farthest = 0;                          // distance from the projector along its z axis, mm
    bool exact = false;                                       // projected pixel by pixel
    std::size_t first = 0;  // of an exact tile: place of its first pixel in the arrays below
  };
  void find_tiles(const DenseMap& map, Executor& executor);
  void find_conflicts();
  void place_exact_tiles();
  void project_pixels(const DenseMap& map, int row);
  [[nodiscard]] Tile tile_at(const DenseMap& map, int column, int row) const;
  /// Calls with each pixel of the exact tiles, and its place in the arrays.
  template <class Take>
  void for_each_exact(const DenseMap& map, const Take& take) const;

  CalibratedCamera camera_;
  Lens projector_;
  std::shared_ptr<const RayGrid> rays_;  // shared by all copies
  int columns_, rows_;                   // of cells
  int tile_columns_ = 0, tile_rows_ = 0;
  std::vector<Tile> tiles_;
  std::vector<float> cell_nearest_, cell_farthest_;
  std::vector<std::int32_t> pixel_;        // for each pixel of the exact tiles: the projector's pixel, or -1
  std::vector<float> distance_, nearest_;  // for each of these, and for each pixel of the projector
};

}  // namespace slsd
