// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image.hpp"
#include "core/regions/find_regions.hpp"

namespace slsd {

struct SeparateOptions {
  /// Side of a tile in camera pixels, as for binarize.
  int tile_px = 12;
  /// Threshold's place between the least and the greatest grey value of the region's pixels nearby.
  float level = 0.35F;
  /// Number of attempts on pieces that did not split; each attempt accepts brighter gaps.
  int rounds = 4;
};

/// Splits regions in which symbols have run together: blur has filled the gaps, or a lit surface ends before a dark
/// background and everything on it is bright. The splitter computes new thresholds from the region's own pixels, tile
/// by tile. So darkness beside the region has no influence, and light may fall off over it.
/// @thread thread-bound: keeps its buffers
class RegionSeparator {
 public:
  explicit RegionSeparator(SeparateOptions options) : options_(options) {}

  /// Splits every `merged` region, and its parts as long as they are merged.
  /// @param contrast_min  smallest difference between light and dark inside a region, levels of the frame
  /// @param merged        bool(const Region&)
  template <class Merged>
  void separate_all(const GreyView& frame, float contrast_min, Regions& regions, Merged&& merged) {
    suspects_.clear();
    const auto suspect_from = [&](std::size_t first) {
      for (std::size_t i = first; i < regions.regions.size(); ++i)
        if (merged(regions.regions[i])) suspects_.push_back(i);
    };
    suspect_from(0);
    if (suspects_.empty()) return;
    for (int round = 0; round < options_.rounds && !suspects_.empty(); ++round) {
      asked_.swap(suspects_);
      suspects_.clear();
      const std::size_t first_part = regions.regions.size();
      for (const std::size_t i : asked_) split(frame, contrast_min, i, regions);
      suspect_from(first_part);
    }
    std::erase_if(regions.regions, [](const Region& region) { return region.area_px == 0; });
  }

 private:
  /// Range of a region's pixels in a tile of its box.
  struct TileRange {
    float least, greatest;
  };
  void split(const GreyView& frame, float contrast_min, std::size_t index, Regions& regions);
  template <class T>
  void find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs, float contrast_min);
  template <class T>
  void measure_tiles(const ImageView<T>& frame, const Region& region, std::span<const Run> runs);
  void set_thresholds(float contrast_min);
  void interpolate(int row);
  template <class T>
  void compare(const ImageView<T>& frame, const Region& region, std::span<const Run> runs);
  template <class Visit>
  void visit_around(int column, int row, Visit&& visit) const;

  SeparateOptions options_;
  int columns_ = 0, rows_ = 0;  // number of tiles
  std::vector<TileRange> tiles_;
  std::vector<std::uint16_t> least_, greatest_;  // for each column of pixels, within a row of tiles
  std::vector<float> midway_, threshold_, line_;
  std::vector<std::int32_t> tile_of_;  // for each column of pixels, and its share of the next tile
  std::vector<float> share_of_;
  std::vector<std::uint8_t> lit_;  // of a row of pixels
  Mask mask_;
  RegionFinder finder_;
  Regions parts_;
  std::vector<std::size_t> suspects_, asked_;
};

}  // namespace slsd
