// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/codebook.hpp"

#include <bit>

namespace slsd {

Codeword codeword_at(const CodeArray& array, int row, int column) {
  Codeword codeword;
  for (int i = 0; i < kWindowCells; ++i) {
    codeword[i] = static_cast<std::uint8_t>(array.at(row - 1 + i / kWindowSide, column - 1 + i % kWindowSide));
  }
  return codeword;
}

Codebook::Codebook(const CodeArray& array, int rows, int columns)
    : letters_(static_cast<std::uint32_t>(array.letters)),
      rows_(rows),
      columns_(columns),
      keys_(static_cast<std::size_t>(rows) * columns, kNoKey),
      mask_(std::bit_ceil(2 * keys_.size() + 1) - 1),
      table_(mask_ + 1, Entry{0, -1, -1}) {
  for (int row = 1; row + 1 < rows; ++row) {
    for (int column = 1; column + 1 < columns; ++column) {
      const std::uint32_t key = key_of(codeword_at(array, row, column));
      keys_[static_cast<std::size_t>(row) * columns + column] = key;
      insert(key, row, column);
    }
  }
}

std::uint32_t Codebook::key_of(const Codeword& codeword) const {
  std::uint32_t key = 0;
  for (const std::uint8_t letter : codeword) key = append(key, letter);
  return key;
}

void Codebook::insert(std::uint32_t key, int row, int column) {
  std::size_t slot = slot_of(key);
  while (table_[slot].row >= 0) slot = (slot + 1) & mask_;
  table_[slot] = {key, static_cast<std::int16_t>(row), static_cast<std::int16_t>(column)};
}

}  // namespace slsd
