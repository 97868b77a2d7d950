// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "core/decode/find_regions.hpp"
#include "core/image.hpp"

namespace slsd {

/// Takes apart regions in which neighbouring symbols have run together: where blur has filled the gap between them, a
/// higher threshold, between the region's own least and greatest grey value, finds it.
/// @thread thread-bound: keeps its buffers
class RegionSplitter {
 public:
  /// Takes every region apart that is `merged`, at the first level that shows it in two parts or more; a part that is
  /// merged still, at the next.
  /// @param levels  0 to 1, between the region's least and greatest grey value
  /// @param merged  bool(const Region&)
  template <class Merged>
  void split_all(const GreyView& frame, std::span<const float> levels, Regions& regions, Merged&& merged) {
    suspects_.clear();
    const auto suspect_from = [&](std::size_t first) {
      for (std::size_t i = first; i < regions.regions.size(); ++i)
        if (merged(regions.regions[i])) suspects_.push_back(i);
    };
    suspect_from(0);
    const std::size_t found = regions.regions.size();
    for (const float level : levels) {
      asked_.swap(suspects_);
      suspects_.clear();
      for (const std::size_t i : asked_) {
        const std::size_t first_part = regions.regions.size();
        if (split(frame, level, i, regions)) {
          suspect_from(first_part);
        } else {
          suspects_.push_back(i);
        }
      }
    }
    if (regions.regions.size() == found) return;
    std::erase_if(regions.regions, [](const Region& region) { return region.area_px == 0; });
  }

 private:
  [[nodiscard]] bool split(const GreyView& frame, float level, std::size_t index, Regions& regions);
  template <class T>
  void find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs, float level);

  Mask mask_;
  RegionFinder finder_;
  Regions parts_;
  std::vector<std::size_t> suspects_, asked_;
};

}  // namespace slsd
