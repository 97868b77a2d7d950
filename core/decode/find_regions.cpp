// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/find_regions.hpp"

#include <algorithm>
#include <bit>

namespace slsd {
namespace {

/// Writes the runs of a row and returns their end; the caller has room for every second pixel.
Run* find_runs_of_row(const Mask& mask, int y, Run* runs) {
  const auto row = static_cast<std::int16_t>(y);
  bool inside = false;
  std::uint64_t last = 0;
  const std::uint64_t* words = mask.row(y);
  for (int x = 0; x < mask.width(); x += Mask::kWordPx) {
    const std::uint64_t bits = *words++;
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
  runs->right = static_cast<std::int16_t>(mask.width());
  runs->row = row;
  return runs + 1;
}

}  // namespace

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

/// Finds the runs of a row and labels them, with those of the row above, from first_above to run_count_, still at hand.
void RegionFinder::label_row(const Mask& mask, int y, std::size_t first_above) {
  const std::size_t first = run_count_, row_max = static_cast<std::size_t>(mask.width()) / 2 + 1;
  if (runs_.size() < first + row_max) {
    runs_.resize(2 * (first + row_max));
    label_of_run_.resize(runs_.size());
  }
  run_count_ = static_cast<std::size_t>(find_runs_of_row(mask, y, runs_.data() + first) - runs_.data());
  auto above = static_cast<int>(first_above);
  for (std::size_t i = first; i < run_count_; ++i) {
    const Run& run = runs_[i];
    label_of_run_[i] = label_of(run, above, static_cast<int>(first));
    Region& region = labels_[label_of_run_[i]].region;
    region.left = std::min<int>(region.left, run.left);
    region.right = std::max(region.right, run.right - 1);
    region.bottom = run.row;
    region.area_px += run.right - run.left;
    ++region.run_count;
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

void RegionFinder::find(const Mask& mask, Regions& found) {
  labels_.clear();
  run_count_ = 0;
  for (std::size_t y = 0, above = 0; y < static_cast<std::size_t>(mask.height()); ++y) {
    const std::size_t first = run_count_;
    label_row(mask, static_cast<int>(y), above);
    above = first;
  }
  number_regions(found);
  gather(found);
}

}  // namespace slsd
