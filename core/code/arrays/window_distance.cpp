// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>

#include "core/code/code_array.hpp"

namespace slsd {
namespace {

// Three bits for each of nine letters: 27 bits. Shares no code with the construction, which it checks.
constexpr std::uint32_t kFirstBitOfEachLetter = 0b001'001'001'001'001'001'001'001'001;
constexpr std::uint32_t kFirstLetterOfEachRow = 0b000'000'111'000'000'111'000'000'111;

// Counts by shifts and sums, which the compiler vectorises on any machine; popcount only on some.
std::uint32_t letters_that_differ(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t bits = a ^ b;
  const std::uint32_t letters = (bits | (bits >> 1) | (bits >> 2)) & kFirstBitOfEachLetter;
  const std::uint32_t rows = (letters + (letters >> 3) + (letters >> 6)) & kFirstLetterOfEachRow;
  return (rows + (rows >> 9) + (rows >> 18)) & 0xF;
}

std::vector<std::uint32_t> all_windows(const CodeArray& array, bool turned) {
  std::vector<std::uint32_t> windows;
  for (int top = 0; top + 2 < array.rows; ++top) {
    for (int left = 0; left + 2 < array.columns; ++left) {
      std::uint32_t window = 0;
      for (int i = 0; i < 9; ++i) {
        const int place = turned ? 8 - i : i;
        window |= static_cast<std::uint32_t>(array.at(top + place / 3, left + place % 3)) << (3 * i);
      }
      windows.push_back(window);
    }
  }
  return windows;
}

std::uint32_t smallest_from(std::uint32_t window, const std::uint32_t* first, const std::uint32_t* last) {
  std::uint32_t smallest = 9;
  for (; first != last; ++first) smallest = std::min(smallest, letters_that_differ(window, *first));
  return smallest;
}

}  // namespace

int minimum_window_distance(const CodeArray& array, bool half_turn) {
  const std::vector<std::uint32_t> windows = all_windows(array, false);
  const std::uint32_t* const end = windows.data() + windows.size();
  std::uint32_t smallest = 9;
  for (std::size_t i = 0; i < windows.size(); ++i)
    smallest = std::min(smallest, smallest_from(windows[i], windows.data() + i + 1, end));
  if (!half_turn) return static_cast<int>(smallest);
  // The distance to a rotated window is symmetric, so pairs from i upwards suffice, including i itself.
  const std::vector<std::uint32_t> turned = all_windows(array, true);
  for (std::size_t i = 0; i < windows.size(); ++i)
    smallest = std::min(smallest, smallest_from(turned[i], windows.data() + i, end));
  return static_cast<int>(smallest);
}

}  // namespace slsd
