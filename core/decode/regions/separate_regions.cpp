// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/separate_regions.hpp"

#include <algorithm>
#include <limits>

namespace slsd {
namespace {

/// Value of a tile that has no pixel of the region near it.
constexpr float kNone = std::numeric_limits<float>::lowest();

}  // namespace

/// Appends the parts of a region, one or more, and empties it. Leaves the region alone if nothing separates it.
void RegionSeparator::split(const GreyView& frame, float contrast_min, std::size_t index, Regions& regions) {
  const Region region = regions.regions[index];
  std::visit([&](const auto& view) { find_parts(view, region, regions.runs_of(region), contrast_min); }, frame);
  if (parts_.regions.empty()) return;
  if (parts_.regions.size() == 1 && parts_.regions[0].area_px == region.area_px) return;
  for (const Region& part : parts_.regions) regions.append(part, parts_.runs_of(part));
  regions.regions[index].area_px = 0;
}

template <class Visit>
void RegionSeparator::visit_around(int column, int row, Visit&& visit) const {
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) visit(r * columns_ + c);
  }
}

template <class T>
void RegionSeparator::measure_tiles(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  const int tile = options_.tile_px;
  columns_ = (region.width_px() + tile - 1) / tile, rows_ = (region.height_px() + tile - 1) / tile;
  tiles_.assign(static_cast<std::size_t>(columns_) * rows_, {std::numeric_limits<float>::max(), kNone});
  for (const Run& run : runs) {
    const T* pixels = frame.row(run.row);
    TileRange* row = tiles_.data() + (run.row - region.top) / tile * columns_;
    for (int x = run.left; x < run.right;) {
      const int column = (x - region.left) / tile;
      const int end = std::min<int>(run.right, region.left + (column + 1) * tile);
      const auto [least, greatest] = std::minmax_element(pixels + x, pixels + end);
      row[column].least = std::min(row[column].least, static_cast<float>(*least));
      row[column].greatest = std::max(row[column].greatest, static_cast<float>(*greatest));
      x = end;
    }
  }
}

/// Sets thresholds as binarize does: midway within 3x3 tiles, then the mean of 3x3 of these.
void RegionSeparator::set_thresholds(float contrast_min) {
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

/// Lights pixels above the thresholds, interpolated between the tiles' centres.
template <class T>
void RegionSeparator::compare(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  const auto tile = static_cast<float>(options_.tile_px);
  mask_.clear(region.width_px(), region.height_px());
  line_.resize(columns_ + 1);
  int row = -1;
  for (const Run& run : runs) {
    if (run.row != row) {
      row = run.row;
      const float v =
          std::clamp((static_cast<float>(row - region.top) + 0.5F) / tile - 0.5F, 0.F, static_cast<float>(rows_ - 1));
      const int above = static_cast<int>(v), below = std::min(above + 1, rows_ - 1);
      const float share = v - static_cast<float>(above);
      for (int c = 0; c < columns_; ++c) {
        const float upper = threshold_[above * columns_ + c], lower = threshold_[below * columns_ + c];
        line_[c] = upper + share * (lower - upper);
      }
      line_[columns_] = line_[columns_ - 1];
    }
    const T* pixels = frame.row(run.row);
    for (int x = run.left; x < run.right; ++x) {
      const float u =
          std::clamp((static_cast<float>(x - region.left) + 0.5F) / tile - 0.5F, 0.F, static_cast<float>(columns_ - 1));
      const int column = static_cast<int>(u);
      const float share = u - static_cast<float>(column);
      const float threshold = line_[column] + share * (line_[column + 1] - line_[column]);
      if (static_cast<float>(pixels[x]) > threshold) mask_.light(x - region.left, run.row - region.top);
    }
  }
}

template <class T>
void RegionSeparator::find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
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

template void RegionSeparator::find_parts(const ImageView<std::uint8_t>&, const Region&, std::span<const Run>, float);
template void RegionSeparator::find_parts(const ImageView<std::uint16_t>&, const Region&, std::span<const Run>, float);

}  // namespace slsd
