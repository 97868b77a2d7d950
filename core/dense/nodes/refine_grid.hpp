// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/appearance/align_blocks.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Fits the nodes between those of a coarse lattice, all at once: each starts from the surface through the four coarse
/// nodes around it, and overlapping windows share the work on their pixels. Nodes that no coarse cell encloses, or that
/// move far, are left to SurfaceGrid::grow().
///
///     #   .   .   .   #      # coarse node, aligned alone
///     .   .   .   .   .      . node of a cell whose corners are one surface: aligned with all others
///     .   .   .   .   .
///     #   .   .   .   #
///
/// @thread thread-bound: keeps its buffers
class GridRefiner {
 public:
  explicit GridRefiner(const SurfaceGrid& grid);
  [[nodiscard]] const CoarseLattice& lattice() const { return lattice_; }
  /// Side of the windows of most nodes, rounded up to an odd number.
  [[nodiscard]] int window_px() const { return window_px_; }
  void refine(const DenseFrame& frame, const BlurredPattern& pattern, SurfaceGrid& grid, Executor& executor);
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

 private:
  /// The surface on a column of the lattice, between two of its nodes.
  using Edge = std::array<float, BlockRow::kNoise>;
  struct Scratch {
    explicit Scratch(const BlockSizes& sizes) : fitter(sizes) {}
    std::vector<BlockRow> rows;
    std::vector<const BlockRow*> around;
    std::vector<std::vector<char>> needed;  // for each row: the groups with nodes to fit
    std::vector<char> wanted, inside;
    std::vector<std::vector<std::uint8_t>> blurs;  // for each row: the level of each group's blur
    std::vector<Edge> edges;
    BlockFitter fitter;
    std::array<PatchTask, kEight> tasks;
  };
  void find_cells(const SurfaceGrid& grid);
  void refine_rows(const DenseFrame& frame, const BlurredPattern& pattern, SurfaceGrid& grid, int first, int end,
                   Scratch& scratch);
  bool start_row(const DenseFrame& frame, const SurfaceGrid& grid, int row, Scratch& scratch, BlockRow& to,
                 std::vector<char>& needed) const;
  void interpolate(const SurfaceGrid& grid, int row, Scratch& scratch, BlockRow& to) const;
  void take_group(const BlurredPattern& pattern, SurfaceGrid& grid, int row, int group, int blur,
                  const Scratch& scratch) const;

  BlockSizes sizes_;
  CoarseLattice lattice_;
  int window_px_;
  std::vector<char> cells_;  // for each coarse node: whether the cell to its lower right is one surface
  std::vector<char> good_;   // for each node: whether it was good before
  std::vector<Scratch> scratch_;
};

}  // namespace slsd
