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
  /// Finds the parts of one region at a level of its own range.
  /// @param level  0 to 1
  /// @return       the parts, in the frame's coordinates; valid until the next call
  template <class T>
  const Regions& split(const ImageView<T>& frame, const Region& region, std::span<const Run> runs, float level);

 private:
  Grey8 mask_;
  RegionFinder finder_;
  Regions parts_;
};

}  // namespace slsd
