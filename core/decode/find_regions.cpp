// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/find_regions.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/clones.hpp"

namespace slsd {
namespace {

/// Ends of runs that are written at once, whether there are as many or not: what lies beyond is written over.
constexpr int kEndsAtOnce = 8;

/// Writes where the runs of a row begin and end, in turn; the caller has room for an end at every pixel and some more.
/// @return the number of runs
inline __attribute__((always_inline)) int find_ends(const std::uint64_t* words, int width, std::uint16_t* ends) {
  constexpr std::uint64_t kLast = std::uint64_t{1} << (Mask::kWordPx - 1);  // so that there is always one to count to
  std::uint16_t* const first = ends;
  std::uint64_t last = 0;
  for (int x = 0; x < width; x += Mask::kWordPx) {
    const std::uint64_t bits = *words++;
    std::uint64_t changes = bits ^ (bits << 1U | last);
    last = bits >> 63U;
    const int count = std::popcount(changes);
    for (int done = 0; done < count; done += kEndsAtOnce) {
      for (int i = 0; i < kEndsAtOnce; ++i, changes &= changes - 1)
        ends[done + i] = static_cast<std::uint16_t>(x + std::countr_zero(changes | kLast));
    }
    ends += count;
  }
  if ((ends - first) % 2 != 0) *ends++ = static_cast<std::uint16_t>(width);
  return static_cast<int>(ends - first) / 2;
}

}  // namespace

std::int32_t RegionFinder::root(std::int32_t label) {
  while (labels_[label].parent != label) label = labels_[label].parent = labels_[labels_[label].parent].parent;
  return label;
}

std::int32_t RegionFinder::join(std::int32_t a, std::int32_t b) {
  const std::int32_t first = root(a), second = root(b);
  return labels_[std::max(first, second)].parent = std::min(first, second);
}

/// Gives each run the label of the runs that it touches in the row above, all made one; a new label where it touches
/// none.
/// @param first_above  the first run of the row above
void RegionFinder::label_row(int y, int runs, const std::uint16_t* above_ends, const std::uint16_t* ends,
                             std::size_t first_above) {
  const std::int32_t* above_label = label_of_run_.data() + first_above;
  Run* out = runs_.data() + run_count_;
  std::int32_t* out_label = label_of_run_.data() + run_count_;
  for (int i = 0; i < runs; ++i, ends += 2) {
    const std::uint16_t left = ends[0], right = ends[1];
    while (above_ends[1] < left) above_ends += 2, ++above_label;
    std::int32_t label = *above_label;
    if (above_ends[0] > right) {
      label = static_cast<std::int32_t>(labels_.size());
      labels_.push_back({label, 0});
    } else {
      const std::int32_t* other = above_label + 1;
      for (const std::uint16_t* next = above_ends + 2; *next <= right; next += 2, ++other)
        if (*other != label) (void)join(label, *other);
    }
    ++labels_[label].runs;
    *out++ = {static_cast<std::int16_t>(y), static_cast<std::int16_t>(left), static_cast<std::int16_t>(right)};
    *out_label++ = label;
  }
  run_count_ += runs;
}

/// One region to each label that is its own parent, in the order of the labels: that of their first pixels. From here
/// on a label's parent is the number of its region.
void RegionFinder::number_regions(Regions& found) {
  found.regions.clear();
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    Label& label = labels_[i];
    if (label.parent == static_cast<std::int32_t>(i)) {
      label.parent = static_cast<std::int32_t>(found.regions.size());
      found.regions.emplace_back().run_count = label.runs;
    } else {
      label.parent = labels_[label.parent].parent;
      found.regions[label.parent].run_count += label.runs;
    }
  }
}

void RegionFinder::gather(Regions& found) {
  next_run_.clear();
  std::int32_t next = 0;
  for (Region& region : found.regions) {
    region.first_run = next;
    next_run_.push_back(next);
    next += region.run_count;
  }
  found.runs.resize(run_count_);
  for (std::size_t i = 0; i < run_count_; ++i) found.runs[next_run_[labels_[label_of_run_[i]].parent]++] = runs_[i];
  for (Region& region : found.regions) {
    const std::span<const Run> runs = found.runs_of(region);
    region.top = runs.front().row, region.bottom = runs.back().row;
    int left = runs.front().left, right = 0, area_px = 0;
    for (const Run& run : runs) {
      left = std::min<int>(left, run.left);
      right = std::max<int>(right, run.right);
      area_px += run.right - run.left;
    }
    region.left = left, region.right = right - 1, region.area_px = area_px;
  }
}

void RegionFinder::find(const Mask& mask, Regions& found) {
  constexpr std::uint16_t kBeyond = std::numeric_limits<std::uint16_t>::max();
  const std::size_t row_max = static_cast<std::size_t>(mask.width()) / 2 + 1;
  for (std::vector<std::uint16_t>& ends : ends_) ends.resize(2 * row_max + kEndsAtOnce + 2);
  labels_.clear();
  run_count_ = 0;
  std::uint16_t *above = ends_[0].data(), *row = ends_[1].data();
  above[0] = above[1] = kBeyond;
  std::size_t first_above = 0;
  for (int y = 0; y < mask.height(); ++y) {
    const int runs = Cloned<find_ends>::call(mask.row(y), mask.width(), row);
    row[2 * runs] = row[2 * runs + 1] = kBeyond;
    // With one more, which is read and not used.
    if (runs_.size() < run_count_ + row_max + 1) {
      runs_.resize(2 * (run_count_ + row_max + 1));
      label_of_run_.resize(runs_.size());
    }
    const std::size_t first = run_count_;
    label_row(y, runs, above, row, first_above);
    first_above = first;
    std::swap(above, row);
  }
  number_regions(found);
  gather(found);
}

}  // namespace slsd
