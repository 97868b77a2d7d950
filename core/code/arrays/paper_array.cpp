// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/paper_array.hpp"

#include <unordered_set>

#include "core/code/arrays/letter_source.hpp"

namespace slsd {
namespace {

std::uint32_t aligned_codeword(const CodeArray& array, int top, int left) {
  std::uint32_t codeword = 0;
  for (int row = top; row < top + kWindowSide; ++row)
    for (int column = left; column < left + kWindowSide; ++column)
      codeword =
          codeword * static_cast<std::uint32_t>(array.letters) + static_cast<std::uint32_t>(array.at(row, column));
  return codeword;
}

}  // namespace

bool aligned_windows_differ(const CodeArray& array) {
  std::unordered_set<std::uint32_t> seen;
  for (int top = 0; top + kWindowSide <= array.rows; top += kWindowSide)
    for (int left = 0; left + kWindowSide <= array.columns; left += kWindowSide)
      if (!seen.insert(aligned_codeword(array, top, left)).second) return false;
  return true;
}

std::optional<CodeArray> draw_paper_array(int rows, int columns, int letters, std::uint32_t seed, int draws) {
  LetterSource source(seed);
  CodeArray array{rows, columns, letters, std::vector<std::uint8_t>(static_cast<std::size_t>(rows) * columns)};
  for (int draw = 0; draw < draws; ++draw) {
    for (std::uint8_t& cell : array.cells) cell = static_cast<std::uint8_t>(source.below(letters));
    if (aligned_windows_differ(array)) return array;
  }
  return std::nullopt;
}

}  // namespace slsd
