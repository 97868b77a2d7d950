// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>

#include "core/code/code_array.hpp"

namespace slsd {

/// Letters in which two runs of a row differ. Slow and plain.
inline int naive_run_difference(const CodeArray& array, int row, int first, int other, int length) {
  int differing = 0;
  for (int i = 0; i < length; ++i) differing += array.at(row, first + i) != array.at(row, other + i);
  return differing;
}

/// Largest distance within which no run of 3 recurs in its row, nor one of 4 with one other letter, nor one of 5 with
/// two. Slow and plain.
inline int naive_row_reach(const CodeArray& array) {
  int reach = array.columns - 3;
  for (int row = 0; row < array.rows; ++row)
    for (int first = 0; first < array.columns; ++first)
      for (int other = first + 1; other < array.columns; ++other) {
        const bool recurs = (other + 3 <= array.columns && naive_run_difference(array, row, first, other, 3) < 1) ||
                            (other + 4 <= array.columns && naive_run_difference(array, row, first, other, 4) < 2) ||
                            (other + 5 <= array.columns && naive_run_difference(array, row, first, other, 5) < 3);
        if (recurs) reach = std::min(reach, other - first - 1);
      }
  return reach;
}

/// The array with its columns as rows.
inline CodeArray naive_transposed(const CodeArray& array) {
  CodeArray turned{array.columns, array.rows, array.letters, {}};
  for (int column = 0; column < array.columns; ++column)
    for (int row = 0; row < array.rows; ++row)
      turned.cells.push_back(array.cells[static_cast<std::size_t>(row * array.columns + column)]);
  return turned;
}

}  // namespace slsd
