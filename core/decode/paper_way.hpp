// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/code/codebook.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/options.hpp"
#include "core/paper/classify.hpp"
#include "core/paper/link_grid.hpp"
#include "core/regions/find_regions.hpp"

namespace slsd {

/// The paper's method for the stages from the descriptors to the codewords, with the inputs and outputs of the
/// decoder's own stages.
/// @thread thread-bound: keeps its buffers
class PaperWay {
 public:
  /// @errors kUnsupported: thresholds cannot separate two of the pattern's symbols
  [[nodiscard]] static Result<PaperWay> create(const IndexedPattern& pattern);

  /// The ten descriptors of every sighting.
  /// @param centre  kPaper: also the centroids of the masks, equations (7) and (8)
  void describe(const Regions& regions, Sightings& seen, Method centre);
  /// Letters by thresholds.
  /// @param side_px  side of a symbol's square in the camera
  void classify(float side_px, Sightings& seen) const;
  /// Links by equations (9) to (22).
  void link_grid(const Regions& regions, int width_px, int height_px, Sightings& seen);
  /// Exact codewords.
  void decode_windows(int rows, int columns, Sightings& seen) const;

 private:
  PaperWay(const IndexedPattern& pattern, std::vector<LetterThresholds> thresholds);

  IndexedPattern pattern_;
  std::vector<LetterThresholds> thresholds_;
  PaperGrid grid_;
  std::vector<PaperRegion> described_;  // one for each sighting
  Image<std::int32_t> labels_;
};

}  // namespace slsd
