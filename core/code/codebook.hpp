// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/code/code_array.hpp"

namespace slsd {

/// The nine letters of a 3x3 window, row by row.
using Codeword = std::array<std::uint8_t, kWindowCells>;

/// Finds windows of the array by their codewords, with up to the number of errors that its minimum distance can
/// correct.
/// @thread reentrant
class Codebook {
 public:
  struct Entry {
    std::uint32_t key;
    std::int16_t row, column;  ///< of the window's middle cell
    std::int8_t errors;        ///< letters of the key that differ from the array's
  };

  /// @param rows, columns  the part of the array that is shown
  /// @param radius         errors to correct, 0 or 1; at most (minimum distance - 1) / 2 where the answers are to be
  /// unique
  Codebook(const CodeArray& array, int rows, int columns, int radius);

  /// The key of a codeword, letter by letter: append(append(0, first), second) and so on to the ninth.
  [[nodiscard]] std::uint32_t append(std::uint32_t key, std::uint8_t letter) const { return key * letters_ + letter; }
  [[nodiscard]] std::uint32_t key_of(const Codeword& codeword) const;

  /// The key of the window around a cell; kNoKey where the cell lies at the border or outside.
  static constexpr std::uint32_t kNoKey = 0xFFFFFFFFU;
  [[nodiscard]] std::uint32_t key_at(int row, int column) const {
    if (row < 0 || column < 0 || row >= rows_ || column >= columns_) return kNoKey;
    return keys_[static_cast<std::size_t>(row) * columns_ + column];
  }

  /// Calls found(const Entry&) for every window within the radius of the codeword.
  template <class Found>
  void find(const Codeword& codeword, Found&& found) const {
    find(key_of(codeword), std::forward<Found>(found));
  }
  template <class Found>
  void find(std::uint32_t key, Found&& found) const {
    for (std::size_t slot = slot_of(key); table_[slot].errors >= 0; slot = (slot + 1) & mask_) {
      if (table_[slot].key == key) found(table_[slot]);
    }
  }

 private:
  [[nodiscard]] std::size_t slot_of(std::uint32_t key) const { return (key * 2654435769U >> 7U) & mask_; }
  void insert(const Codeword& codeword, int row, int column, int errors);

  std::uint32_t letters_;
  int rows_, columns_;
  std::vector<std::uint32_t> keys_;  // of the cells
  std::size_t mask_;
  std::vector<Entry> table_;  // open addressing, at most half full
};

/// The codeword around a cell that has all its neighbours.
[[nodiscard]] Codeword codeword_at(const CodeArray& array, int row, int column);

}  // namespace slsd
