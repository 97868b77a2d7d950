// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/separate_regions.hpp"

#include <algorithm>
#include <limits>

#include "core/clones.hpp"

namespace slsd {
namespace {

/// Value of a tile that has no pixel of the region near it.
constexpr float kNone = std::numeric_limits<float>::lowest();

/// @param thresholds   one for each tile and one more
/// @param tiles, shares  for each pixel: the tile whose centre lies before it, and its place up to that of the next
/// @param lit          becomes 255 for each pixel above its threshold, and 0 for others
template <class T>
inline __attribute__((always_inline)) void light_run(const T* pixels, int count, const float* thresholds,
                                                     const std::int32_t* tiles, const float* shares,
                                                     std::uint8_t* lit) {
#pragma omp simd
  for (int x = 0; x < count; ++x) {
    const float before = thresholds[tiles[x]], after = thresholds[tiles[x] + 1];
    lit[x] = static_cast<float>(pixels[x]) > before + shares[x] * (after - before) ? 255 : 0;
  }
}

}  // namespace

const Regions& RegionSplitter::split(const GreyView& frame, float contrast_min, const Region& region,
                                     std::span<const Run> runs) {
  std::visit([&](const auto& view) { find_parts(view, region, runs, contrast_min); }, frame);
  if (parts_.regions.size() == 1 && parts_.regions[0].area_px == region.area_px) parts_.regions.clear();
  return parts_;
}

template <class Visit>
void RegionSplitter::visit_around(int column, int row, Visit&& visit) const {
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) visit(r * columns_ + c);
  }
}

/// Finds the range of each column over the rows of a tile, and then over the columns of a tile.
template <class T>
void RegionSplitter::measure_tiles(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  const int tile = options_.tile_px, width = region.width_px();
  columns_ = (width + tile - 1) / tile, rows_ = (region.height_px() + tile - 1) / tile;
  tiles_.assign(static_cast<std::size_t>(columns_) * rows_, {std::numeric_limits<float>::max(), kNone});
  auto run = runs.begin();
  for (int row = 0; row < rows_; ++row) {
    least_.assign(width, std::numeric_limits<std::uint16_t>::max()), greatest_.assign(width, 0);
    for (; run != runs.end() && run->row < region.top + (row + 1) * tile; ++run) {
      const T* const pixels = frame.row(run->row) + run->left;
      std::uint16_t *const least = least_.data() + run->left - region.left, *const greatest = greatest_.data() +
                                                                                              run->left - region.left;
      const int count = run->right - run->left;
#pragma omp simd
      for (int x = 0; x < count; ++x) {
        least[x] = std::min<std::uint16_t>(least[x], pixels[x]);
        greatest[x] = std::max<std::uint16_t>(greatest[x], pixels[x]);
      }
    }
    for (int column = 0; column < columns_; ++column) {
      const int first = column * tile, last = std::min(first + tile, width);
      std::uint16_t least = std::numeric_limits<std::uint16_t>::max(), greatest = 0;
      for (int x = first; x < last; ++x)
        least = std::min(least, least_[x]), greatest = std::max(greatest, greatest_[x]);
      if (least <= greatest)
        tiles_[static_cast<std::size_t>(row) * columns_ + column] = {static_cast<float>(least),
                                                                     static_cast<float>(greatest)};
    }
  }
}

/// Sets thresholds as binarize does: midway within 3x3 tiles, then the mean of 3x3 of these.
void RegionSplitter::set_thresholds(float contrast_min) {
  midway_.assign(tiles_.size(), kNone);
  threshold_.assign(tiles_.size(), 0);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      TileRange around{std::numeric_limits<float>::max(), kNone};
      visit_around(column, row, [&](int i) {
        around.least = std::min(around.least, tiles_[i].least);
        around.greatest = std::max(around.greatest, tiles_[i].greatest);
      });
      if (around.greatest < around.least) continue;
      const float contrast = around.greatest - around.least;
      midway_[row * columns_ + column] =
          contrast < contrast_min ? around.least - 1 : around.least + options_.level * contrast;
    }
  }
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      float sum = 0, count = 0;
      visit_around(column, row, [&](int i) {
        if (midway_[i] != kNone) sum += midway_[i], ++count;
      });
      threshold_[row * columns_ + column] = count > 0 ? sum / count : 0;
    }
  }
}

/// Interpolates the thresholds of a row of tiles to a row of pixels.
void RegionSplitter::interpolate(int row) {
  const float v = std::clamp((static_cast<float>(row) + 0.5F) / static_cast<float>(options_.tile_px) - 0.5F, 0.F,
                             static_cast<float>(rows_ - 1));
  const int above = static_cast<int>(v), below = std::min(above + 1, rows_ - 1);
  const float share = v - static_cast<float>(above);
  for (int c = 0; c < columns_; ++c) {
    const float upper = threshold_[above * columns_ + c], lower = threshold_[below * columns_ + c];
    line_[c] = upper + share * (lower - upper);
  }
  line_[columns_] = line_[columns_ - 1];
}

/// Lights pixels above the thresholds, interpolated between the tiles' centres.
template <class T>
void RegionSplitter::compare(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  const auto tile = static_cast<float>(options_.tile_px);
  const int width = region.width_px(), words = (width + Mask::kWordPx - 1) / Mask::kWordPx;
  mask_.clear(width, region.height_px());
  line_.resize(columns_ + 1);
  tile_of_.resize(width), share_of_.resize(width);
  for (int x = 0; x < width; ++x) {
    const float u = std::clamp((static_cast<float>(x) + 0.5F) / tile - 0.5F, 0.F, static_cast<float>(columns_ - 1));
    tile_of_[x] = static_cast<int>(u), share_of_[x] = u - static_cast<float>(tile_of_[x]);
  }
  for (auto run = runs.begin(); run != runs.end();) {
    const int row = run->row;
    interpolate(row - region.top);
    lit_.assign(static_cast<std::size_t>(words) * Mask::kWordPx, 0);
    for (; run != runs.end() && run->row == row; ++run) {
      const std::ptrdiff_t from = run->left - region.left;
      Cloned<light_run<T>>::call(frame.row(row) + run->left, run->right - run->left, line_.data(),
                                 tile_of_.data() + from, share_of_.data() + from, lit_.data() + from);
    }
    for (int word = 0; word < words; ++word)
      mask_.row(row - region.top)[word] = top_bits(lit_.data() + static_cast<std::ptrdiff_t>(word) * Mask::kWordPx);
  }
}

template <class T>
void RegionSplitter::find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                float contrast_min) {
  measure_tiles(frame, region, runs);
  set_thresholds(contrast_min);
  compare(frame, region, runs);
  finder_.find(mask_, parts_);
  for (Region& part : parts_.regions) {
    part.left += region.left, part.right += region.left;
    part.top += region.top, part.bottom += region.top;
  }
  for (Run& run : parts_.runs) {
    run.row = static_cast<std::int16_t>(run.row + region.top);
    run.left = static_cast<std::int16_t>(run.left + region.left);
    run.right = static_cast<std::int16_t>(run.right + region.left);
  }
}

/// Appends the parts of the asked regions in their order, and empties these.
void RegionSeparator::split_asked(const GreyView& frame, float contrast_min, Regions& regions, Executor& executor) {
  const auto first_of = [&](std::size_t share) { return share * asked_.size() / shares_.size(); };
  executor.run(static_cast<int>(shares_.size()), [&](int number, int) {
    Share& share = shares_[number];
    share.parts.regions.clear(), share.parts.runs.clear(), share.ends.clear();
    for (std::size_t i = first_of(number); i < first_of(number + 1); ++i) {
      const Region& region = regions.regions[asked_[i]];
      const Regions& found = share.splitter.split(frame, contrast_min, region, regions.runs_of(region));
      for (const Region& part : found.regions) share.parts.append(part, found.runs_of(part));
      share.ends.push_back(share.parts.regions.size());
    }
  });
  for (std::size_t number = 0; number < shares_.size(); ++number) {
    const auto& [splitter, parts, ends] = shares_[number];
    std::size_t part = 0;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (part < ends[i]) regions.regions[asked_[first_of(number) + i]].area_px = 0;
      for (; part < ends[i]; ++part) regions.append(parts.regions[part], parts.runs_of(parts.regions[part]));
    }
  }
}

template void RegionSplitter::find_parts(const ImageView<std::uint8_t>&, const Region&, std::span<const Run>, float);
template void RegionSplitter::find_parts(const ImageView<std::uint16_t>&, const Region&, std::span<const Run>, float);

}  // namespace slsd
