// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
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

/// Steps from coarse to fine, as align() uses them.
inline constexpr std::array kCellSteps{16, 8, 4};

/// A camera's range image with its cells.
struct SurfaceView {
  RangeImage image;
  std::array<CellGrid, kCellSteps.size()> levels;
  std::vector<Rgb> colours;  ///< means of the cells of the finest level; empty: the cloud has none
};

/// All that one frame measured.
struct Shot {
  std::vector<SurfaceView> views;  ///< one for each camera

  [[nodiscard]] std::size_t cells() const;  ///< how many were measured at the finest level
  [[nodiscard]] Eigen::Vector3d middle_mm() const;
};

/// @thread reentrant
[[nodiscard]] Shot make_shot(std::vector<RangeImage> images);

}  // namespace slsd::model
