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

/// An index of windows for the question "is any of them closer than d?", which it answers at once for all letters of
/// the last cell. Two words of nine letters that differ in fewer than d places agree on at least one of d groups of
/// places (pigeonhole). So a window is filed under its letters in each group, and a query reads only the files of d
/// groups.
/// @thread thread-bound
class WindowIndex {
 public:
  /// @param letters           2 to 8
  /// @param minimum_distance  1 to 9
  WindowIndex(int letters, int minimum_distance);

  /// Letters with which, as its last, the window is closer to one of the index: one bit for each letter.
  /// @param window   its last letter does not matter
  /// @param letters  the letters in question, one bit for each
  [[nodiscard]] unsigned closer_with(PackedWindow window, unsigned letters) const;
  void add(PackedWindow window);
  /// Removes the window that was added last.
  void remove_last(PackedWindow window);

 private:
  using File = std::vector<PackedWindow>;
  struct Group {
    int first_cell;
    int cells;
    std::vector<File> files;
  };
  [[nodiscard]] std::size_t file_of(const Group& group, PackedWindow window) const;
  [[nodiscard]] unsigned closer_in(const File& file, PackedWindow window) const;

  int letters_;
  int minimum_distance_;
  std::vector<Group> groups_;
};

}  // namespace slsd
