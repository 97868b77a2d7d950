// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "core/appearance/pattern_field.hpp"
#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/dense/pixels/blend_cells.hpp"
#include "core/dense/pixels/evidence_table.hpp"

namespace slsd {

/// Evidence on each side of a pixel: left, right, above, below, and toward the four corners. A surface that ends near
/// the pixel has evidence on one side alone. A side is that half or quarter of the surroundings, with the pixel's own
/// line: the pixels along the side's border.
struct SideEvidence {
  static constexpr int kSides = 8, kHalves = 4;
  std::array<float, kSides> line;  ///< of each own line alone, against another surface
  float strength;                  ///< the least evidence of the side with the most
  int most;                        ///< that side; -1 if none has enough
};

/// Assigns each camera pixel a surface between the grid's nodes. If the nodes are one surface and all pixels agree, it
/// is a blend of their planes. Otherwise each pixel gets the nearby plane that its surroundings support most, if they
/// support any. At an edge, each of two surfaces keeps its own pixels: those on its side that fit it better than the
/// other.
/// @thread thread-bound: keeps its buffers
class PixelJudge {
 public:
  struct Options {
    int reach_px = 3;    ///< reach of a pixel's surroundings to each side
    int window_px = 11;  ///< a node's window: planes are continued no farther
    double depth_min_mm, depth_max_mm;
  };
  explicit PixelJudge(const Options& options) : options_(options) {}

  /// @param within  pixels that matter: elsewhere, cells of several surfaces have no points, and others are not
  /// reviewed
  void judge(const DenseFrame& frame, const BlurredPattern& pattern, const SurfaceGrid& grid, DenseMap& map,
             const PixelRectangle& within, Executor& executor);

 private:
  static constexpr int kCandidates = 6;
  struct Scratch {
    explicit Scratch(CellBlender blends) : blender(std::move(blends)) {}
    CellBlender blender;
    std::vector<float> goods;  // for each cell of a row: number of good nodes within the reach of candidates
    std::vector<float> seen, evidence, sums, least[kCandidates], own[kCandidates];
    std::vector<SideEvidence> sides[kCandidates];
  };
  struct Cell;
  void resize(const SurfaceGrid& grid, int workers);
  static void count_goods(const SurfaceGrid& grid, int row, std::vector<float>& goods);
  void review(Cell& cell, Scratch& scratch) const;
  void judge_cell(Cell& cell, Scratch& scratch) const;
  void see(const Cell& cell, Scratch& scratch) const;
  void weigh(const Cell& cell, const SurfaceNode& node, int candidate, int as, Scratch& scratch) const;
  void choose(const Cell& cell, const Scratch& scratch) const;
  [[nodiscard]] int choose_on_one_surface(const Cell& cell, const Scratch& scratch, int at, int x, int y) const;
  [[nodiscard]] int choose_plane(const Cell& cell, const Scratch& scratch, int x, int y) const;

  Options options_;
  EvidenceTable table_;
  int side_ = 0;                // side of the block around a cell
  std::vector<float> xs_, ys_;  // pixels relative to the cell's first
  std::vector<Scratch> scratch_;
};

}  // namespace slsd
