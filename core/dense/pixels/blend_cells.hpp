// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/dense/dense_map.hpp"
#include "core/dense/nodes/surface_grid.hpp"
#include "core/lanes.hpp"

namespace slsd {

/// Kinds of cells, by the evidence of their four nodes.
enum class CellKind : std::uint8_t {
  kApart,     ///< several surfaces, or less than four nodes
  kDoubtful,  ///< one surface that some pixels may contradict
  kClean,     ///< one surface
};

/// Fills the cells whose nodes are one surface with the blend of their planes, a row of pixels at a time.
/// @thread thread-bound: keeps the last row's nodes; one to a worker
class CellBlender {
 public:
  /// @param grid  of the size of all that follow
  CellBlender(const SurfaceGrid& grid, double depth_min_mm, double depth_max_mm);

  /// Begins a frame. @param full  its level of a saturated pixel
  void begin(double full);
  /// Writes the pixels between two rows of nodes. Clears those of all other cells.
  /// @param row  the upper one
  /// @return a kind for each cell, from the one to the right of the first node
  std::span<const CellKind> blend_row(const SurfaceGrid& grid, int row, DenseMap& map);

 private:
  /// Numbers of a row of nodes: arrays, one after the other.
  enum Number : std::uint8_t { kGood, kValue, kSlopeX, kSlopeY, kPerPx, kNoise, kSupport, kSigma, kLight, kNumbers };
  /// Coefficients for a row of pixels, as polynomials in the place within a cell: three of the inverse depth, two of
  /// sigma, two of the light.
  static constexpr int kCoefficients = 7;
  void read_nodes(const SurfaceGrid& grid, int row, std::vector<float>& to) const;
  void take_both(Number which, const float* (&of)[2]) const;  // of the upper and the lower nodes
  void find_kinds();
  void set_coefficients(int y);
  void blend_run(int first, int end, std::size_t pixel, DenseMap& map) const;

  int stride_, columns_;
  float depth_min_mm_, depth_max_mm_, of_full_ = 1;
  std::size_t pitch_;
  int lower_row_ = -2;  // whose numbers lower_ holds
  std::vector<float> upper_, lower_, coefficients_;
  std::vector<CellKind> kinds_;
  // For each pixel, until they repeat: its cell, relative to that of the first of its eight, and its place there.
  std::vector<std::int32_t> place_cells_;
  std::vector<float> place_xs_;
};

}  // namespace slsd
