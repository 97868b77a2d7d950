// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/runs.hpp"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <string>
#include <vector>

namespace slsd {
namespace {

// One character for each letter. Shares no code with the construction, which it checks.
std::vector<std::string> lines_of(const CodeArray& array, Along along) {
  const bool rows = along == Along::kRows;
  std::vector<std::string> lines(static_cast<std::size_t>(rows ? array.rows : array.columns));
  for (int row = 0; row < array.rows; ++row)
    for (int column = 0; column < array.columns; ++column)
      lines[static_cast<std::size_t>(rows ? row : column)] += static_cast<char>('0' + array.at(row, column));
  return lines;
}

bool recurs(const std::string& run, const std::string& other) {
  int equal = 0;
  for (std::size_t i = 0; i < run.size(); ++i) equal += run[i] == other[i] ? 1 : 0;
  return equal >= kShortestRun;
}

std::vector<std::string> runs_of(const std::string& line, int length) {
  std::vector<std::string> runs;
  for (std::size_t first = 0; first + static_cast<std::size_t>(length) <= line.size(); ++first)
    runs.push_back(line.substr(first, static_cast<std::size_t>(length)));
  return runs;
}

// For each run, the distance to the nearest run that makes it recur, over the whole array; 0 if there is none.
std::vector<int> recurrences(const CodeArray& array, Along along, int length) {
  assert(length >= kShortestRun && length <= kLongestRun);
  std::vector<int> nearest;
  for (const std::string& line : lines_of(array, along)) {
    const std::vector<std::string> runs = runs_of(line, length);
    const int count = static_cast<int>(runs.size());
    for (int i = 0; i < count; ++i) {
      int apart = 0;
      for (int j = 0; j < count; ++j)
        if (i != j && (apart == 0 || std::abs(i - j) < apart) && recurs(runs[i], runs[j])) apart = std::abs(i - j);
      nearest.push_back(apart);
    }
  }
  return nearest;
}

}  // namespace

std::optional<int> nearest_recurrence(const CodeArray& array, Along along, int length) {
  std::optional<int> nearest;
  for (const int apart : recurrences(array, along, length))
    if (apart > 0) nearest = std::min(apart, nearest.value_or(apart));
  return nearest;
}

int repeat_free_reach(const CodeArray& array, Along along) {
  int reach = (along == Along::kRows ? array.columns : array.rows) - kShortestRun;
  for (int length = kShortestRun; length <= kLongestRun; ++length)
    if (const auto nearest = nearest_recurrence(array, along, length)) reach = std::min(reach, *nearest - 1);
  return reach;
}

double recurring_share(const CodeArray& array, Along along, int length, int within) {
  const std::vector<int> nearest = recurrences(array, along, length);
  const auto near = std::ranges::count_if(nearest, [&](int apart) { return apart > 0 && apart <= within; });
  return nearest.empty() ? 0 : static_cast<double>(near) / static_cast<double>(nearest.size());
}

}  // namespace slsd
