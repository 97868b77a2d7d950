// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/nodes/ray_grid.hpp"

#include "core/geometry/ray_table.hpp"

namespace slsd {

RayGrid::RayGrid(const Lens& lens) : columns_((lens.width_px - 1) / kPitchPx + 2) {
  const RayTable rays(lens);
  const int rows = (lens.height_px - 1) / kPitchPx + 2;
  nodes_.reserve(static_cast<std::size_t>(columns_) * rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d pixel(column * kPitchPx, row * kPitchPx);
      nodes_.push_back(rays.ray(pixel).direction.cast<float>());
    }
  }
}

}  // namespace slsd
