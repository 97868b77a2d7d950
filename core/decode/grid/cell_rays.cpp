// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/cell_rays.hpp"

namespace slsd {

CellRays::CellRays(const Pattern& pattern, const std::vector<Prototype>& prototypes, const Lens& projector)
    : rows_(pattern.whole_rows()), columns_(pattern.whole_columns()) {
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d square(pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(row));
      pixels_.push_back(square + prototypes[pattern.array.at(row, column)].centroid_px.cast<double>());
      rays_.push_back(pixel_ray(projector, pixels_.back()));
      directions_.push_back(rays_.back().direction);
    }
  }
}

}  // namespace slsd
