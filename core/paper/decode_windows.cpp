// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/decode_windows.hpp"

#include <array>
#include <unordered_map>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

using Window = std::array<std::int32_t, kWindowCells>;  // regions, row by row
using Codeword = std::uint32_t;

Codeword append(Codeword word, int letter) {
  return word * kMaxLetters + static_cast<Codeword>(letter);
}

Codeword codeword_at(const CodeArray& array, int row, int column) {
  Codeword word = 0;
  for (int i = 0; i < kWindowCells; ++i) word = append(word, array.at(row + i / kWindowSide, column + i % kWindowSide));
  return word;
}

std::unordered_map<Codeword, ArrayCell> codebook_of(const CodeArray& array) {
  std::unordered_map<Codeword, ArrayCell> codebook;
  for (int row = 0; row + kWindowSide <= array.rows; ++row) {
    for (int column = 0; column + kWindowSide <= array.columns; ++column) {
      codebook.try_emplace(codeword_at(array, row, column), ArrayCell{row, column});
    }
  }
  return codebook;
}

std::int32_t follow(std::span<const Links> links, std::int32_t region, Direction direction) {
  return region < 0 ? -1 : links[static_cast<std::size_t>(region)][direction];
}

Window window_from(std::span<const Links> links, std::int32_t first) {
  Window window{};
  for (int row = 0; row < kWindowSide; ++row) {
    std::int32_t region = first;
    for (int column = 0; column < kWindowSide; ++column) {
      window[static_cast<std::size_t>(row * kWindowSide + column)] = region;
      region = follow(links, region, kRight);
    }
    first = follow(links, first, kDown);
  }
  return window;
}

std::optional<Codeword> codeword_of(const Window& window, std::span<const int> letters) {
  Codeword word = 0;
  for (const std::int32_t region : window) {
    if (region < 0 || letters[static_cast<std::size_t>(region)] < 0) return std::nullopt;
    word = append(word, letters[static_cast<std::size_t>(region)]);
  }
  return word;
}

void give_cells(const Window& window, const ArrayCell& first, std::vector<std::optional<ArrayCell>>& cells) {
  for (int i = 0; i < kWindowCells; ++i) {
    auto& cell = cells[static_cast<std::size_t>(window[static_cast<std::size_t>(i)])];
    if (!cell) cell = ArrayCell{first.row + i / kWindowSide, first.column + i % kWindowSide};
  }
}

}  // namespace

std::vector<std::optional<ArrayCell>> decode_windows_paper(std::span<const int> letters, std::span<const Links> links,
                                                           const CodeArray& array) {
  const auto codebook = codebook_of(array);
  std::vector<std::optional<ArrayCell>> cells(letters.size());
  for (std::size_t i = 0; i < letters.size(); ++i) {
    const Window window = window_from(links, static_cast<std::int32_t>(i));
    const auto word = codeword_of(window, letters);
    if (!word) continue;
    const auto entry = codebook.find(*word);
    if (entry != codebook.end()) give_cells(window, entry->second, cells);
  }
  return cells;
}

}  // namespace slsd
