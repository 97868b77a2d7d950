// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/find_regions.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/clones.hpp"

namespace slsd {
namespace {

/// Number of run ends written at once, even if there are fewer: the next write overwrites the excess.
constexpr int kEndsAtOnce = 6;

/// Writes the starts and ends of the runs of a row, alternating. The caller has room for an end at every pixel and some
/// more.
/// @return the number of runs
inline __attribute__((always_inline)) int find_ends(const std::uint64_t* words, int width, std::uint16_t* ends) {
  constexpr std::uint64_t kLast = std::uint64_t{1} << (Mask::kWordPx - 1);  // so that there is always a bit to count to
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

void measure_box(std::span<const Run> runs, Region& region) {
  region.top = runs.front().row, region.bottom = runs.back().row;
  int left = runs.front().left, right = 0, area_px = 0;
  for (const Run& run : runs) {
    left = std::min<int>(left, run.left);
    right = std::max<int>(right, run.right);
    area_px += run.right - run.left;
  }
  region.left = left, region.right = right - 1, region.area_px = area_px;
}

}  // namespace

std::int32_t RegionFinder::root(Labels& labels, std::int32_t label) {
  while (labels[label].parent != label) label = labels[label].parent = labels[labels[label].parent].parent;
  return label;
}

std::int32_t RegionFinder::join(Labels& labels, std::int32_t a, std::int32_t b) {
  const std::int32_t first = root(labels, a), second = root(labels, b);
  return labels[std::max(first, second)].parent = std::min(first, second);
}

/// Gives each run the merged label of the runs that it touches in the row above, or a new label if it touches none.
/// @param first_above  the first run of the row above
void RegionFinder::label_row(int y, int runs, const std::uint16_t* above_ends, const std::uint16_t* ends,
                             std::size_t first_above, Band& band) {
  Labels& labels = band.labels;
  const std::int32_t* above_label = band.label_of_run.data() + first_above;
  Run* out = band.runs.data() + band.run_count;
  std::int32_t* out_label = band.label_of_run.data() + band.run_count;
  for (int i = 0; i < runs; ++i, ends += 2) {
    const std::uint16_t left = ends[0], right = ends[1];
    while (above_ends[1] < left) above_ends += 2, ++above_label;
    std::int32_t label = *above_label;
    if (above_ends[0] > right) {
      label = static_cast<std::int32_t>(labels.size());
      labels.push_back({label, 0});
    } else {
      const std::int32_t* other = above_label + 1;
      for (const std::uint16_t* next = above_ends + 2; *next <= right; next += 2, ++other)
        if (*other != label) (void)join(labels, *other, label);
    }
    ++labels[label].runs;
    *out++ = {static_cast<std::int16_t>(y), static_cast<std::int16_t>(left), static_cast<std::int16_t>(right)};
    *out_label++ = label;
  }
  band.run_count += runs;
}

void RegionFinder::label_rows(const Mask& mask, int top, int bottom, Band& band) {
  constexpr std::uint16_t kBeyond = std::numeric_limits<std::uint16_t>::max();
  const std::size_t row_max = static_cast<std::size_t>(mask.width()) / 2 + 1;
  for (std::vector<std::uint16_t>& ends : band.ends) ends.resize(2 * row_max + kEndsAtOnce + 2);
  band.labels.clear();
  band.run_count = band.first_of_last_row = 0;
  std::uint16_t *above = band.ends[0].data(), *row = band.ends[1].data();
  above[0] = above[1] = kBeyond;
  for (int y = top; y < bottom; ++y) {
    const int runs = Cloned<find_ends>::call(mask.row(y), mask.width(), row);
    row[2 * runs] = row[2 * runs + 1] = kBeyond;
    // One extra element, which is read but not used.
    if (band.runs.size() < band.run_count + row_max + 1) {
      band.runs.resize(2 * (band.run_count + row_max + 1));
      band.label_of_run.resize(band.runs.size());
    }
    const std::size_t first = band.run_count;
    label_row(y, runs, above, row, band.first_of_last_row, band);
    band.first_of_last_row = first;
    if (y == top) band.first_row_runs = band.run_count;
    std::swap(above, row);
  }
}

/// Collects the labels in the order of the bands, which is also the order of their first pixels.
void RegionFinder::collect_labels(std::span<Band> bands) {
  labels_.clear();
  for (Band& band : bands) {
    band.first_label = static_cast<std::int32_t>(labels_.size());
    for (const Label& label : band.labels) labels_.push_back({band.first_label + label.parent, label.runs});
  }
}

void RegionFinder::join_bands(const Band& above, const Band& below) {
  std::size_t first = above.first_of_last_row;
  for (std::size_t i = 0; i < below.first_row_runs; ++i) {
    const Run& run = below.runs[i];
    while (first < above.run_count && above.runs[first].right < run.left) ++first;
    for (std::size_t other = first; other < above.run_count && above.runs[other].left <= run.right; ++other)
      (void)join(labels_, above.first_label + above.label_of_run[other], below.first_label + below.label_of_run[i]);
  }
}

/// Makes one region from each label that is its own parent, in the order of the labels, and so of their first pixels.
/// From here on, a label's parent is the number of its region.
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

/// Places each band's runs of each region. From here on, a label's parent is the first label of its region in its band,
/// which stores the write position.
void RegionFinder::place_runs(std::span<const Band> bands, Regions& found) {
  std::int32_t next = 0;
  cursor_.clear();
  for (Region& region : found.regions) {
    region.first_run = next;
    cursor_.push_back(next);
    next += region.run_count;
  }
  found.runs.resize(next);
  holder_.assign(found.regions.size(), -1);
  next_run_.resize(labels_.size());
  for (const Band& band : bands) {
    const auto end = band.first_label + static_cast<std::int32_t>(band.labels.size());
    for (std::int32_t i = band.first_label; i < end; ++i) {
      const std::int32_t region = labels_[i].parent;
      if (holder_[region] < band.first_label) holder_[region] = i, next_run_[i] = cursor_[region];
      labels_[i].parent = holder_[region];
      cursor_[region] += labels_[i].runs;
    }
  }
}

void RegionFinder::gather(const Band& band, Regions& found) {
  const Label* labels = labels_.data() + band.first_label;
  for (std::size_t i = 0; i < band.run_count; ++i)
    found.runs[next_run_[labels[band.label_of_run[i]].parent]++] = band.runs[i];
}

void RegionFinder::find(const Mask& mask, Regions& found, Executor& executor) {
  constexpr int kBandRows = 96;
  const int count = (mask.height() + kBandRows - 1) / kBandRows;
  if (bands_.size() < static_cast<std::size_t>(count)) bands_.resize(count);
  const std::span<Band> bands = std::span(bands_).first(count);
  executor.run(count, [&](int band, int) {
    label_rows(mask, band * kBandRows, std::min((band + 1) * kBandRows, mask.height()), bands[band]);
  });
  collect_labels(bands);
  for (int band = 1; band < count; ++band) join_bands(bands[band - 1], bands[band]);
  number_regions(found);
  place_runs(bands, found);
  executor.run(count, [&](int band, int) { gather(bands[band], found); });
  executor.run_ranges(found.regions.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) measure_box(found.runs_of(found.regions[i]), found.regions[i]);
  });
}

}  // namespace slsd
