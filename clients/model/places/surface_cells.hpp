// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "clients/model/range_image.hpp"

namespace slsd::model {

/// A small plane of the surface, in the rig's frame.
struct SurfaceCell {
  Eigen::Vector3f place_mm;
  Eigen::Vector3f normal;  ///< towards the camera
  float sigma_mm = 0;      ///< one standard deviation along the normal; 0: nothing was measured here
  bool foreign = false;    ///< does not move with the object: mark_foreign()
};

/// Planes fitted to squares of `step` pixels. A cell that straddles an edge in depth has the surface of its middle.
struct CellGrid {
  int step = 1;
  int width = 0, height = 0;
  std::vector<SurfaceCell> cells;  ///< row by row

  /// @param x, y  pixel of the range image's crop
  [[nodiscard]] const SurfaceCell* at(float x, float y) const {
    const int column = static_cast<int>(x) / step, row = static_cast<int>(y) / step;
    if (!(x >= 0) || !(y >= 0) || column >= width || row >= height) return nullptr;
    const SurfaceCell& cell =
        cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
    return cell.sigma_mm > 0 ? &cell : nullptr;
  }
};

/// Calls visit(index) for the cells around one. @param column, row  may lie outside
template <class Visit>
void visit_cells_around(const CellGrid& grid, int column, int row, int radius, Visit&& visit) {
  for (int y = std::max(0, row - radius); y <= std::min(grid.height - 1, row + radius); ++y)
    for (int x = std::max(0, column - radius); x <= std::min(grid.width - 1, column + radius); ++x)
      visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x));
}
template <class Visit>
void visit_cells_around(const CellGrid& grid, std::size_t cell, int radius, Visit&& visit) {
  const auto width = static_cast<std::size_t>(grid.width);
  visit_cells_around(grid, static_cast<int>(cell % width), static_cast<int>(cell / width), radius, visit);
}

/// Steps from coarse to fine, as align() uses them.
inline constexpr std::array kCellSteps{16, 8, 4};

/// Planes fitted to the squares of each step, coarse ones first. @thread reentrant
[[nodiscard]] std::array<CellGrid, kCellSteps.size()> fit_cells(const RangeImage& image);

}  // namespace slsd::model
