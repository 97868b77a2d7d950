// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/find_regions.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace slsd {
namespace {

/// First pixel from x on that is lit (or dark, where `lit` is false), eight at a time; the first of them in memory is
/// the lowest byte.
static_assert(std::endian::native == std::endian::little);
inline int next_change(const std::uint8_t* mask, int x, int width, bool lit) {
  const std::uint64_t same = lit ? 0 : ~std::uint64_t{0};
  while (x + 8 <= width) {
    std::uint64_t eight;
    std::memcpy(&eight, mask + x, sizeof eight);
    if (eight != same) return x + std::countr_zero(eight ^ same) / 8;
    x += 8;
  }
  while (x < width && (mask[x] != 0) != lit) ++x;
  return x;
}

}  // namespace

void RegionFinder::find_runs(const ImageView<std::uint8_t>& mask) {
  runs_.clear();
  first_run_of_row_.assign(static_cast<std::size_t>(mask.height) + 1, 0);
  for (int y = 0; y < mask.height; ++y) {
    first_run_of_row_[y] = static_cast<int>(runs_.size());
    const std::uint8_t* row = mask.row(y);
    for (int x = next_change(row, 0, mask.width, true); x < mask.width;) {
      const int end = next_change(row, x, mask.width, false);
      runs_.push_back({static_cast<std::int16_t>(y), static_cast<std::int16_t>(x), static_cast<std::int16_t>(end)});
      x = next_change(row, end, mask.width, true);
    }
  }
  first_run_of_row_[mask.height] = static_cast<int>(runs_.size());
}

int RegionFinder::root(int run) {
  while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
  return run;
}

void RegionFinder::join_touching_runs(int height) {
  parent_.resize(runs_.size());
  for (std::size_t i = 0; i < parent_.size(); ++i) parent_[i] = static_cast<int>(i);
  for (int y = 1; y < height; ++y) {
    int above = first_run_of_row_[y - 1];
    const int above_end = first_run_of_row_[y], below_end = first_run_of_row_[y + 1];
    for (int below = above_end; below < below_end; ++below) {
      while (above < above_end && runs_[above].right < runs_[below].left) ++above;
      for (int i = above; i < above_end && runs_[i].left <= runs_[below].right; ++i) {
        const int a = root(i), b = root(below);
        parent_[std::max(a, b)] = std::min(a, b);
      }
    }
  }
}

void RegionFinder::gather(Regions& found) {
  found.regions.clear();
  region_of_run_.resize(runs_.size());
  for (int i = 0; i < static_cast<int>(runs_.size()); ++i) {
    const Run& run = runs_[i];
    const int first = root(i);
    if (first == i) {
      region_of_run_[i] = static_cast<int>(found.regions.size());
      found.regions.push_back({run.left, run.row, run.right - 1, run.row, 0, 0, 0});
    } else {
      region_of_run_[i] = region_of_run_[first];
    }
    Region& region = found.regions[region_of_run_[i]];
    region.left = std::min<int>(region.left, run.left);
    region.right = std::max(region.right, run.right - 1);
    region.bottom = run.row;
    region.area_px += run.right - run.left;
    ++region.run_count;
  }
  int next = 0;
  for (Region& region : found.regions) {
    region.first_run = next;
    next += region.run_count;
    region.run_count = 0;
  }
  found.runs.resize(runs_.size());
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    Region& region = found.regions[region_of_run_[i]];
    found.runs[region.first_run + region.run_count++] = runs_[i];
  }
}

void RegionFinder::find(const ImageView<std::uint8_t>& mask, Regions& found) {
  find_runs(mask);
  join_touching_runs(mask.height);
  gather(found);
}

}  // namespace slsd
