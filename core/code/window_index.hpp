// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/code/array.hpp"

namespace slsd {

/// The letters of a 3x3 window, row by row, four bits each; the first letter in the lowest bits.
using PackedWindow = std::uint64_t;

/// The window rotated by 180 degrees.
[[nodiscard]] PackedWindow half_turned(PackedWindow window);

/// Counts the cells in which two windows differ.
[[nodiscard]] int cells_that_differ(PackedWindow a, PackedWindow b);

/// An index of windows for the question "is any of them closer than d?". Two words of nine letters that differ in fewer
/// than d places agree on at least one of d groups of places (pigeonhole). So a window is filed under its letters in
/// each group, and a query reads only d files.
/// @thread thread-bound
class WindowIndex {
 public:
  /// @param letters           2 to 8
  /// @param minimum_distance  1 to 9
  WindowIndex(int letters, int minimum_distance);

  [[nodiscard]] bool has_closer(PackedWindow window) const;
  void add(PackedWindow window);
  /// Removes the window that was added last.
  void remove_last(PackedWindow window);

 private:
  struct Group {
    int first_cell;
    int cells;
    std::vector<std::vector<PackedWindow>> files;
  };
  [[nodiscard]] std::size_t file_of(const Group& group, PackedWindow window) const;

  int letters_;
  int minimum_distance_;
  std::vector<Group> groups_;
};

}  // namespace slsd
