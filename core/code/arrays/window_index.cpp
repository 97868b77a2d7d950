// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/window_index.hpp"

#include <algorithm>
#include <cassert>

namespace slsd {
namespace {

constexpr PackedWindow kLowestBits = 0x1'1111'1111;
constexpr PackedWindow kAllButLast = 0x0'FFFF'FFFF;
constexpr int kLastCell = kWindowCells - 1;

int letter_at(PackedWindow window, int cell) {
  return static_cast<int>(window >> (4 * cell) & 0xF);
}

constexpr std::size_t kMaxFiles = 1 << 15;

std::size_t files_of(int letters, int cells) {
  std::size_t files = 1;
  for (int i = 0; i < cells; ++i) files *= static_cast<std::size_t>(letters);
  return files;
}

// Words that agree on a whole group agree on its first cells: this gives fewer and longer files with the same answers.
int cells_filed(int letters, int cells) {
  while (files_of(letters, cells) > kMaxFiles) --cells;
  return cells;
}

}  // namespace

PackedWindow half_turned(PackedWindow window) {
  PackedWindow turned = 0;
  for (int cell = 0; cell < kWindowCells; ++cell) turned = turned << 4 | (window >> (4 * cell) & 0xF);
  return turned;
}

int cells_that_differ(PackedWindow a, PackedWindow b) {
  const PackedWindow bits = a ^ b;
  // Letters have three bits. The product's ninth nibble is the sum of all nine. Without an instruction of its own,
  // popcount is a call.
  return static_cast<int>(((bits | bits >> 1 | bits >> 2) & kLowestBits) * kLowestBits >> 32 & 0xF);
}

WindowIndex::WindowIndex(int letters, int minimum_distance) : letters_(letters), minimum_distance_(minimum_distance) {
  assert(letters >= kMinLetters && letters <= kMaxLetters);
  assert(minimum_distance >= 1 && minimum_distance <= kWindowCells);
  for (int i = 0; i < minimum_distance; ++i) {
    const int first = kWindowCells * i / minimum_distance;
    const int cells = cells_filed(letters, kWindowCells * (i + 1) / minimum_distance - first);
    groups_.push_back({first, cells, {}});
    groups_.back().files.resize(files_of(letters, cells));
  }
}

std::size_t WindowIndex::file_of(const Group& group, PackedWindow window) const {
  std::size_t file = 0;
  for (int cell = group.first_cell; cell < group.first_cell + group.cells; ++cell)
    file = file * static_cast<std::size_t>(letters_) + static_cast<std::size_t>(letter_at(window, cell));
  return file;
}

unsigned WindowIndex::closer_in(const File& file, PackedWindow window) const {
  unsigned closer = 0;
  for (const PackedWindow other : file) {
    const int differing = cells_that_differ(window & kAllButLast, other & kAllButLast);
    if (differing < minimum_distance_ - 1) return ~0U;
    if (differing < minimum_distance_) closer |= 1U << letter_at(other, kLastCell);
  }
  return closer;
}

unsigned WindowIndex::closer_with(PackedWindow window, unsigned letters) const {
  unsigned fit = letters;
  for (const Group& group : groups_) {
    const auto file = group.files.begin() + static_cast<std::ptrdiff_t>(file_of(group, window & kAllButLast));
    if (group.first_cell + group.cells < kWindowCells) {
      fit &= ~closer_in(*file, window);
      continue;
    }
    // Windows that differ in the last letter alone stand in neighbouring files.
    for (int letter = 0; letter < letters_; ++letter)
      if ((fit >> letter & 1U) != 0) fit &= ~closer_in(file[letter], window);
  }
  return letters & ~fit;
}

void WindowIndex::add(PackedWindow window) {
  for (Group& group : groups_) group.files[file_of(group, window)].push_back(window);
}

void WindowIndex::remove_last(PackedWindow window) {
  for (Group& group : groups_) {
    auto& file = group.files[file_of(group, window)];
    assert(!file.empty() && file.back() == window);
    file.pop_back();
  }
}

}  // namespace slsd
