// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/nearest_name.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace slsd {
namespace {

constexpr std::size_t kLongestWord = 64;  // a longer word is no misspelling of a key
constexpr std::size_t kShortestBeginning = 3;

const std::string* only_name_that_begins_with(std::string_view word, std::span<const std::string> names) {
  if (word.size() < kShortestBeginning) return nullptr;
  const auto begins = [&](const std::string& name) { return name.starts_with(word); };
  const auto first = std::ranges::find_if(names, begins);
  if (first == names.end() || std::any_of(first + 1, names.end(), begins)) return nullptr;
  return &*first;
}

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = std::exchange(row[0], static_cast<int>(i) + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::optional<std::string> nearest_name(std::string_view word, std::span<const std::string> names) {
  if (word.size() > kLongestWord) return std::nullopt;
  const std::string* nearest = nullptr;
  int least = std::max(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    if (distance < least) {
      least = distance;
      nearest = &name;
    }
  }
  if (nearest == nullptr) nearest = only_name_that_begins_with(word, names);
  return nearest == nullptr ? std::nullopt : std::optional(*nearest);
}

std::string nearest_hint(std::string_view word, std::span<const std::string> names) {
  const auto nearest = nearest_name(word, names);
  return nearest ? "; did you mean " + *nearest + "?" : std::string();
}

}  // namespace slsd
