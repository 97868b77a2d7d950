// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/split_regions.hpp"

#include <algorithm>

namespace slsd {

/// Appends the parts of a region and empties it; leaves it alone where the level does not part it.
bool RegionSplitter::split(const GreyView& frame, float level, std::size_t index, Regions& regions) {
  const Region region = regions.regions[index];
  std::visit([&](const auto& view) { find_parts(view, region, regions.runs_of(region), level); }, frame);
  if (parts_.regions.size() < 2) return false;
  for (const Region& part : parts_.regions) regions.append(part, parts_.runs_of(part));
  regions.regions[index].area_px = 0;
  return true;
}

template <class T>
void RegionSplitter::find_parts(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                float level) {
  T low = frame.at(runs[0].left, runs[0].row), high = low;
  for (const Run& run : runs) {
    const auto [least, greatest] = std::minmax_element(frame.row(run.row) + run.left, frame.row(run.row) + run.right);
    low = std::min(low, *least);
    high = std::max(high, *greatest);
  }
  const float threshold = static_cast<float>(low) + level * static_cast<float>(high - low);
  mask_.clear(region.width_px(), region.height_px());
  for (const Run& run : runs) {
    for (int x = run.left; x < run.right; ++x) {
      if (static_cast<float>(frame.at(x, run.row)) > threshold) mask_.light(x - region.left, run.row - region.top);
    }
  }
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

template void RegionSplitter::find_parts(const ImageView<std::uint8_t>&, const Region&, std::span<const Run>, float);
template void RegionSplitter::find_parts(const ImageView<std::uint16_t>&, const Region&, std::span<const Run>, float);

}  // namespace slsd
