// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd {

inline constexpr int kWindowSide = 3;
inline constexpr int kWindowCells = kWindowSide * kWindowSide;
inline constexpr int kMinLetters = 2;
inline constexpr int kMaxLetters = 8;
inline constexpr int kMaxArrayExtent = 512;  ///< rows or columns; 3840 px at the smallest pitch give 427

/// The robust pseudo-random array: rows x columns letters, letter values 0 to letters - 1, row by row.
struct CodeArray {
  int rows = 0;
  int columns = 0;
  int letters = 0;
  std::vector<std::uint8_t> cells;
  /// Result of minimum_window_distance() when the array was made or read, with turned windows if requested; 0 if it was
  /// not computed. Computing it takes seconds for the largest arrays.
  int minimum_distance = 0;
  /// Results of repeat_free_reach() along rows, in columns, and along columns, in rows. 0 unless the array was made or
  /// read as ArrayMethod::kNoRepeats.
  int row_reach = 0, column_reach = 0;

  [[nodiscard]] int at(int row, int column) const { return cells[static_cast<std::size_t>(row) * columns + column]; }
  friend bool operator==(const CodeArray&, const CodeArray&) = default;
};

enum class ArrayMethod {
  kPaper,         ///< aligned windows pairwise different, by rejection (Elahi et al. 2020, figure 2)
  kConstructive,  ///< every overlapping window unique, with a minimum Hamming distance
  kNoRepeats,     ///< the same, and no run of letters recurs nearby in its row or column (core/code/arrays/runs.hpp)
};

/// Name of a method in a pattern file or the configuration: "paper", "constructive", "no_repeats".
[[nodiscard]] std::string_view to_string(ArrayMethod method);

struct ArrayOptions {
  int rows = 45;
  int columns = 72;
  int letters = 3;
  std::uint32_t seed = 1;
  ArrayMethod method = ArrayMethod::kConstructive;
  /// Hamming distance over all overlapping windows; if missing, the largest that the search reaches.
  std::optional<int> minimum_distance{};
  bool half_turn_unique = false;  ///< windows also differ from every window rotated by 180 degrees
  /// kNoRepeats only: number of columns within which no run recurs in its row, 0 to 512. If missing, as far as the
  /// search gets, rows first; with few letters this may be 0.
  std::optional<int> row_reach{};
  /// The same for runs along columns, in rows.
  std::optional<int> column_reach{};

  [[nodiscard]] Result<> validate() const;
};

}  // namespace slsd
