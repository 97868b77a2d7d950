// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "clients/model/places/surface_cells.hpp"
#include "clients/model/places/surface_edges.hpp"
#include "clients/model/range_image.hpp"

namespace slsd::model {

/// A camera's range image with its cells.
struct SurfaceView {
  RangeImage image;
  std::array<CellGrid, kCellSteps.size()> levels;
  EdgeGrid edges;
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

/// A shot without edges: not to be aligned, but to be fused. @thread reentrant
[[nodiscard]] Shot make_shot_to_fuse(std::vector<RangeImage> images);

}  // namespace slsd::model
