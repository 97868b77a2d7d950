// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/symbols/prototypes.hpp"
#include "core/geometry/pixel_ray.hpp"

namespace slsd {

/// Projector rays of the cells' symbols: each symbol's centroid as the camera's estimator finds it, and the ray of that
/// pixel.
/// @thread reentrant
class CellRays {
 public:
  CellRays(const Pattern& pattern, const std::vector<Prototype>& prototypes, const Lens& projector);

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] const Eigen::Vector2d& pixel(int row, int column) const { return pixels_[index(row, column)]; }
  [[nodiscard]] const PixelRay& ray(int row, int column) const { return rays_[index(row, column)]; }
  /// The ray's direction, for searches of many cells.
  [[nodiscard]] const Eigen::Vector2d& direction(int row, int column) const { return directions_[index(row, column)]; }

 private:
  [[nodiscard]] std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * columns_ + column;
  }

  int rows_, columns_;
  std::vector<Eigen::Vector2d> pixels_, directions_;
  std::vector<PixelRay> rays_;
};

}  // namespace slsd
