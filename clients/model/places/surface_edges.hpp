// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "clients/model/places/surface_cells.hpp"
#include "clients/model/range_image.hpp"

namespace slsd::model {

/// A short piece of a sharp edge, where a surface that faces the camera ends. In the rig's frame.
struct SurfaceEdge {
  Eigen::Vector3f place_mm;
  Eigen::Vector3f normal;  ///< of the surface, towards the camera
  Eigen::Vector3f across;  ///< unit vector in the surface, at right angles to the edge, away from the surface
  float sigma_mm = 0;      ///< one standard deviation along `across`
  std::size_t cell = 0;    ///< of the finest grid: the surface that ends
};

/// Edges of a view, at most one in each cell of the finest grid.
struct EdgeGrid {
  static constexpr std::int32_t kNone = -1;

  std::vector<SurfaceEdge> edges;
  std::vector<std::int32_t> of_cell;  ///< index of its edge, or kNone; empty: edges were not looked for

  [[nodiscard]] const SurfaceEdge* of(std::size_t cell) const {
    if (edges.empty() || of_cell[cell] == kNone) return nullptr;
    return &edges[static_cast<std::size_t>(of_cell[cell])];
  }
};

/// Finds the edges at which the surface itself ends. A border of the measurement is no such edge if the surface goes on
/// after a gap, if a nearer surface hides or shades what follows, or if the camera's image, the projector's or the box
/// ends there.
/// @param grid  of the finest level
/// @thread reentrant
[[nodiscard]] EdgeGrid surface_edges(const RangeImage& image, const CellGrid& grid);

}  // namespace slsd::model
