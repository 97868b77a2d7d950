// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/cloud/cloud.hpp"

namespace slsd {

/// A cloud whose depth at each cell is given by a function of (column, row); no point where it is 0. Cells are 10 mm
/// apart at 1000 mm, growing with the depth.
template <class Depth>
Cloud lattice_cloud(int columns, int rows, Depth depth) {
  Cloud cloud;
  cloud.lattice_columns = columns;
  cloud.lattice_rows = rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto z = static_cast<float>(depth(column, row));
      if (z == 0) continue;
      CloudPoint point;
      point.x = 0.01F * z * (static_cast<float>(column) - 0.5F * static_cast<float>(columns - 1));
      point.y = 0.01F * z * (static_cast<float>(row) - 0.5F * static_cast<float>(rows - 1));
      point.z = z;
      point.column = static_cast<std::uint16_t>(column);
      point.row = static_cast<std::uint16_t>(row);
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

}  // namespace slsd
