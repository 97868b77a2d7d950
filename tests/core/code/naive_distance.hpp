// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>

#include "core/code/code_array.hpp"

namespace slsd {

/// Letters in which the windows at two places differ; the second one turned by 180 degrees where asked. Slow and plain.
inline int naive_difference(const CodeArray& array, int top, int left, int other_top, int other_left, bool turned) {
  int differing = 0;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      differing += array.at(top + row, left + column) !=
                   array.at(other_top + (turned ? 2 - row : row), other_left + (turned ? 2 - column : column));
  return differing;
}

/// minimum_window_distance by six loops.
inline int naive_minimum_distance(const CodeArray& array, bool half_turn) {
  int smallest = 9;
  for (int top = 0; top + 3 <= array.rows; ++top)
    for (int left = 0; left + 3 <= array.columns; ++left)
      for (int other_top = 0; other_top + 3 <= array.rows; ++other_top)
        for (int other_left = 0; other_left + 3 <= array.columns; ++other_left) {
          if (top != other_top || left != other_left)
            smallest = std::min(smallest, naive_difference(array, top, left, other_top, other_left, false));
          if (half_turn) smallest = std::min(smallest, naive_difference(array, top, left, other_top, other_left, true));
        }
  return smallest;
}

}  // namespace slsd
