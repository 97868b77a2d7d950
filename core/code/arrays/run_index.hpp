// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

namespace slsd {

/// An index of the letters of parallel lines for the question "which letters would end a recurring run here?"
/// (core/code/arrays/runs.hpp). It has one bit for each place of a line and each letter, so that one operation compares
/// a run with 64 earlier ones.
/// @thread thread-bound
class RunIndex {
 public:
  /// @param cells    cells of a line
  /// @param letters  2 to 8
  /// @param reach    distance within which no run may recur, in cells; 0: runs may recur anywhere
  RunIndex(int lines, int cells, int letters, int reach);

  /// Letters that end a recurring run at the line's first empty place, one bit for each letter.
  [[nodiscard]] unsigned ending_recurring_run(int line, int place) const;
  /// Appends a letter to a line, at its first empty place.
  void add(int line, int place, int letter);
  /// Removes the last letter of a line.
  void remove_last(int line, int place, int letter);

 private:
  [[nodiscard]] std::size_t first_word(int line, int letter) const;
  [[nodiscard]] std::uint64_t places_moved(int line, int letter, int word, int by) const;
  [[nodiscard]] std::uint64_t equal_twice(int line, int place, int word) const;

  int cells_;
  int letters_;
  int reach_;
  int words_;                           // of 64 places, for one letter of a line
  std::vector<std::uint64_t> places_;   // by line, then letter: the places that have the letter
  std::vector<std::uint8_t> in_lines_;  // the letters of the lines
};

}  // namespace slsd
