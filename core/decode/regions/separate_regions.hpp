// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/executor.hpp"
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

/// Splits a region by new thresholds, which it computes from the region's own pixels, tile by tile. So darkness beside
/// the region has no influence, and light may fall off over it.
/// @thread thread-bound: keeps its buffers
class RegionSplitter {
 public:
  explicit RegionSplitter(SeparateOptions options) : options_(options) {}

  /// @param contrast_min  smallest difference between light and dark inside a region, levels of the frame
  /// @return the parts, one or more; none if nothing separates the region. Valid until the next call.
  const Regions& split(const GreyView& frame, float contrast_min, const Region& region, std::span<const Run> runs);

 private:
  /// Range of a region's pixels in a tile of its box.
  struct TileRange {
    float least, greatest;
  };
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
};

/// Splits regions in which symbols have run together: blur has filled the gaps, or a lit surface ends before a dark
/// background and everything on it is bright.
/// @thread thread-bound: keeps its buffers
class RegionSeparator {
 public:
  explicit RegionSeparator(SeparateOptions options) : options_(options), shares_(kShares, {RegionSplitter(options)}) {}

  /// Splits every `merged` region, and its parts as long as they are merged.
  /// @param contrast_min  as for RegionSplitter
  /// @param merged        bool(const Region&)
  template <class Merged>
  void separate_all(const GreyView& frame, float contrast_min, Regions& regions, Merged&& merged, Executor& executor) {
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
      split_asked(frame, contrast_min, regions, executor);
      suspect_from(first_part);
    }
    std::erase_if(regions.regions, [](const Region& region) { return region.area_px == 0; });
  }
  template <class Merged>
  void separate_all(const GreyView& frame, float contrast_min, Regions& regions, Merged&& merged) {
    SerialExecutor alone;
    separate_all(frame, contrast_min, regions, std::forward<Merged>(merged), alone);
  }

 private:
  static constexpr std::size_t kShares = 8;  // whatever the number of workers, so that buffers grow alike
  /// Some of the asked regions, and their parts one after the other.
  struct Share {
    RegionSplitter splitter;
    Regions parts{};
    std::vector<std::size_t> ends{};  // for each of the regions: the end of its parts
  };
  void split_asked(const GreyView& frame, float contrast_min, Regions& regions, Executor& executor);

  SeparateOptions options_;
  std::vector<Share> shares_;
  std::vector<std::size_t> suspects_, asked_;
};

}  // namespace slsd
