// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/arrays/hamming_profile.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/code/arrays/window_index.hpp"

namespace slsd {
namespace {

PackedWindow window_at(const CodeArray& array, int top, int left) {
  PackedWindow window = 0;
  for (int row = top; row < top + kWindowSide; ++row)
    for (int column = left; column < left + kWindowSide; ++column)
      window = window << 4 | static_cast<PackedWindow>(array.at(row, column));
  return window;
}

std::vector<PackedWindow> windows_of(const CodeArray& array, int step) {
  std::vector<PackedWindow> windows;
  for (int top = 0; top + kWindowSide <= array.rows; top += step)
    for (int left = 0; left + kWindowSide <= array.columns; left += step)
      windows.push_back(window_at(array, top, left));
  return windows;
}

}  // namespace

std::int64_t HammingProfile::comparisons() const {
  return std::accumulate(pairs.begin(), pairs.end(), std::int64_t{0});
}

double HammingProfile::mean() const {
  double sum = 0;
  for (std::size_t distance = 0; distance < pairs.size(); ++distance)
    sum += static_cast<double>(distance) * static_cast<double>(pairs[distance]);
  return sum / static_cast<double>(comparisons());
}

double HammingProfile::share_from(int distance) const {
  const auto far = std::accumulate(pairs.begin() + distance, pairs.end(), std::int64_t{0});
  return static_cast<double>(far) / static_cast<double>(comparisons());
}

int HammingProfile::minimum() const {
  return static_cast<int>(std::ranges::find_if(pairs, [](std::int64_t count) { return count > 0; }) - pairs.begin());
}

HammingProfile hamming_profile(const CodeArray& array, Windows windows) {
  const auto all = windows_of(array, windows == Windows::kAligned ? kWindowSide : 1);
  HammingProfile profile;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j)
      ++profile.pairs[static_cast<std::size_t>(cells_that_differ(all[i], all[j]))];
  return profile;
}

}  // namespace slsd
