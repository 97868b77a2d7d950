// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/decode/find_regions.hpp"
#include "core/image.hpp"

namespace slsd {

/// Takes apart regions in which neighbouring symbols have run together: where blur has filled the gap between them, a
/// higher threshold, between the region's own least and greatest grey value, finds it.
/// @thread thread-bound: keeps its buffers
class RegionSplitter {
 public:
  /// Takes every region apart that is `merged`, where the level shows it in two parts or more.
  /// @param level   0 to 1, between the region's least and greatest grey value
  /// @param merged  bool(const Region&)
  template <class Merged>
  void split_all(const GreyView& frame, float level, Regions& regions, Merged&& merged) {
    const std::size_t count = regions.regions.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Region region = regions.regions[i];
      if (!merged(region)) continue;
      std::visit([&](const auto& view) { find_parts(view, region, regions.runs_of(region), level); }, frame);
      if (parts_.regions.size() < 2) continue;
      for (const Region& part : parts_.regions) regions.append(part, parts_.runs_of(part));
      regions.regions[i].area_px = 0;
    }
    std::erase_if(regions.regions, [](const Region& region) { return region.area_px == 0; });
  }

 private:
  template <class T>
  void find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs, float level);

  Grey8 mask_;
  RegionFinder finder_;
  Regions parts_;
};

}  // namespace slsd
