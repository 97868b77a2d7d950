// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include "core/decode/decoding.hpp"

namespace slsd {

/// The visible cells of the pattern. A cell is one number, row * columns + column; -1 is none.
struct CellGrid {
  int rows = 0, columns = 0;

  [[nodiscard]] bool shows(int row, int column) const {
    return row >= 0 && column >= 0 && row < rows && column < columns;
  }
  [[nodiscard]] std::int32_t at(int row, int column) const { return shows(row, column) ? row * columns + column : -1; }
  [[nodiscard]] int row_of(std::int32_t cell) const { return cell / columns; }
  [[nodiscard]] int column_of(std::int32_t cell) const { return cell % columns; }
  /// The cell beside another; -1 outside the pattern and for -1.
  [[nodiscard]] std::int32_t beyond(std::int32_t cell, Direction d) const {
    if (cell < 0) return -1;
    return at(row_of(cell) + (d == kDown) - (d == kUp), column_of(cell) + (d == kRight) - (d == kLeft));
  }
};

}  // namespace slsd
