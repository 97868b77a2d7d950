// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/find_regions.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace slsd {
namespace {

constexpr int kWordPx = 64;

/// Bit i tells whether pixel i is lit, of at most 64. The product moves the top bits of eight bytes side by side; the
/// first pixel in memory is the lowest byte.
static_assert(std::endian::native == std::endian::little);
std::uint64_t lit_bits(const std::uint8_t* mask, int count) {
  std::uint64_t bytes[kWordPx / 8] = {};
  std::memcpy(bytes, mask, count < kWordPx ? static_cast<std::size_t>(count) : sizeof bytes);
  std::uint64_t bits = 0;
  for (int i = 0; i < kWordPx / 8; ++i) {
    bits |= ((bytes[i] & 0x8080808080808080U) * 0x0002040810204081U >> 56U) << (8 * i);
  }
  return bits;
}

/// Writes the runs of a row and returns their end; the caller has room for every second pixel.
Run* find_runs_of_row(const std::uint8_t* mask, int y, int width, Run* runs) {
  const auto row = static_cast<std::int16_t>(y);
  bool inside = false;
  std::uint64_t last = 0;
  for (int x = 0; x < width; x += kWordPx) {
    const std::uint64_t bits = lit_bits(mask + x, std::min(kWordPx, width - x));
    std::uint64_t changes = bits ^ (bits << 1U | last);
    last = bits >> 63U;
    for (; changes != 0; changes &= changes - 1) {
      const auto at = static_cast<std::int16_t>(x + std::countr_zero(changes));
      (inside ? runs->right : runs->left) = at;
      if (inside) runs++->row = row;
      inside = !inside;
    }
  }
  if (!inside) return runs;
  runs->right = static_cast<std::int16_t>(width);
  runs->row = row;
  return runs + 1;
}

}  // namespace

void RegionFinder::find_runs(const ImageView<std::uint8_t>& mask) {
  const std::size_t row_max = static_cast<std::size_t>(mask.width) / 2 + 1;
  first_run_of_row_.resize(static_cast<std::size_t>(mask.height) + 1);
  std::size_t count = 0;
  for (int y = 0; y < mask.height; ++y) {
    first_run_of_row_[y] = static_cast<int>(count);
    if (runs_.size() < count + row_max) runs_.resize(2 * (count + row_max));
    count = static_cast<std::size_t>(find_runs_of_row(mask.row(y), y, mask.width, runs_.data() + count) - runs_.data());
  }
  first_run_of_row_[mask.height] = static_cast<int>(count);
  run_count_ = count;
}

int RegionFinder::root(int label) {
  while (labels_[label].parent != label) label = labels_[label].parent = labels_[labels_[label].parent].parent;
  return label;
}

/// The label of the runs that a run touches in the row above, all made one; a new label where it touches none.
/// @param above  the first run there that does not end before it; moves on from run to run
int RegionFinder::label_of(const Run& run, int& above, int above_end) {
  while (above < above_end && runs_[above].right < run.left) ++above;
  int label = -1;
  for (int i = above; i < above_end && runs_[i].left <= run.right; ++i) {
    if (label < 0) label = label_of_run_[i];
    if (label == label_of_run_[i]) continue;
    const int a = root(label), b = root(label_of_run_[i]);
    labels_[std::max(a, b)].parent = std::min(a, b);
  }
  if (label >= 0) return label;
  labels_.push_back({static_cast<int>(labels_.size()), {run.left, run.row, run.right - 1, run.row, 0, 0, 0}});
  return labels_.back().parent;
}

void RegionFinder::label_runs(int height) {
  labels_.clear();
  label_of_run_.resize(run_count_);
  for (int y = 0, above = 0; y < height; ++y) {
    const int first = first_run_of_row_[y], end = first_run_of_row_[y + 1];
    for (int i = first; i < end; ++i) {
      const Run& run = runs_[i];
      label_of_run_[i] = label_of(run, above, first);
      Region& region = labels_[label_of_run_[i]].region;
      region.left = std::min<int>(region.left, run.left);
      region.right = std::max(region.right, run.right - 1);
      region.bottom = run.row;
      region.area_px += run.right - run.left;
      ++region.run_count;
    }
    above = first;
  }
}

/// One region to each label that is its own parent, in the order of the labels: that of their first pixels. From here
/// on a label's parent is the number of its region.
void RegionFinder::number_regions(Regions& found) {
  found.regions.clear();
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    Label& label = labels_[i];
    if (label.parent == static_cast<int>(i)) {
      label.parent = static_cast<int>(found.regions.size());
      found.regions.push_back(label.region);
      continue;
    }
    label.parent = labels_[label.parent].parent;
    Region& whole = found.regions[label.parent];
    whole.left = std::min(whole.left, label.region.left);
    whole.right = std::max(whole.right, label.region.right);
    whole.bottom = std::max(whole.bottom, label.region.bottom);
    whole.area_px += label.region.area_px;
    whole.run_count += label.region.run_count;
  }
}

void RegionFinder::gather(Regions& found) {
  int next = 0;
  next_run_.clear();
  for (Region& region : found.regions) {
    region.first_run = next;
    next_run_.push_back(next);
    next += region.run_count;
  }
  found.runs.resize(run_count_);
  for (std::size_t i = 0; i < run_count_; ++i) found.runs[next_run_[labels_[label_of_run_[i]].parent]++] = runs_[i];
}

void RegionFinder::find(const ImageView<std::uint8_t>& mask, Regions& found) {
  find_runs(mask);
  label_runs(mask.height);
  number_regions(found);
  gather(found);
}

}  // namespace slsd
