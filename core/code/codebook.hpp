// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/code/pattern.hpp"

namespace slsd {

/// The nine letters of a 3x3 window, row by row.
using Codeword = std::array<std::uint8_t, kWindowCells>;

/// Finds windows of the array by their codewords, or by codewords that differ in one letter.
///
/// Stores only the windows themselves, 12 bytes each in a table at most half full. To correct a misread codeword, it
/// looks up all 9 (letters - 1) words that differ in one letter. The table fits the cache.
/// @thread reentrant
class Codebook {
 public:
  struct Entry {
    std::uint32_t key;
    std::int16_t row, column;  ///< cell at the window's centre; row -1: an empty slot
  };

  /// @param rows, columns  the part of the array that is shown
  Codebook(const CodeArray& array, int rows, int columns);

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int columns() const { return columns_; }

  /// Extends the key of a codeword by a letter: append(append(0, first), second) and so on to the ninth.
  [[nodiscard]] std::uint32_t append(std::uint32_t key, std::uint8_t letter) const { return key * letters_ + letter; }
  [[nodiscard]] std::uint32_t key_of(const Codeword& codeword) const;

  /// The key of the window around a cell; kNoKey if the cell lies at the border or outside.
  static constexpr std::uint32_t kNoKey = 0xFFFFFFFFU;
  [[nodiscard]] std::uint32_t key_at(int row, int column) const {
    if (row < 0 || column < 0 || row >= rows_ || column >= columns_) return kNoKey;
    return keys_[static_cast<std::size_t>(row) * columns_ + column];
  }

  /// Calls found(const Entry&) for every window of the codeword.
  template <class Found>
  void find(std::uint32_t key, Found&& found) const {
    for (std::size_t slot = slot_of(key); table_[slot].row >= 0; slot = (slot + 1) & mask_) {
      if (table_[slot].key == key) found(table_[slot]);
    }
  }
  /// The same for every window that differs from the codeword in one letter.
  template <class Found>
  void find_one_off(std::uint32_t key, Found&& found) const {
    std::uint32_t worth = 1;  // weight of the letter in the key
    for (int i = 0; i < kWindowCells; ++i, worth *= letters_) {
      const std::uint32_t read = key / worth % letters_, without = key - read * worth;
      for (std::uint32_t letter = 0; letter < letters_; ++letter)
        if (letter != read) find(without + letter * worth, found);
    }
  }

 private:
  [[nodiscard]] std::size_t slot_of(std::uint32_t key) const { return (key * 2654435769U >> 7U) & mask_; }
  void insert(std::uint32_t key, int row, int column);

  std::uint32_t letters_;
  int rows_, columns_;
  std::vector<std::uint32_t> keys_;  // for each cell
  std::size_t mask_;
  std::vector<Entry> table_;  // open addressing, at most half full
};

/// The codeword around a cell that has all its neighbours.
[[nodiscard]] Codeword codeword_at(const CodeArray& array, int row, int column);

/// A pattern with the codebook of its fully visible symbols. Copies share both, which never change: one instance serves
/// every camera, thread and trial.
class IndexedPattern {
 public:
  IndexedPattern(Pattern pattern)  // NOLINT: a pattern is one
      : both_(std::make_shared<const Both>(std::move(pattern))) {}

  [[nodiscard]] const Pattern& pattern() const { return both_->pattern; }
  [[nodiscard]] std::shared_ptr<const CodeArray> array() const { return {both_, &both_->pattern.array}; }
  /// The codebook, which also keeps the pattern alive.
  [[nodiscard]] std::shared_ptr<const Codebook> codebook() const { return {both_, &both_->codebook}; }

 private:
  struct Both {
    explicit Both(Pattern shown)
        : pattern(std::move(shown)), codebook(pattern.array, pattern.whole_rows(), pattern.whole_columns()) {}
    Pattern pattern;
    Codebook codebook;
  };
  std::shared_ptr<const Both> both_;
};

}  // namespace slsd
