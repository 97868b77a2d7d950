// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/link_grid.hpp"
#include "core/decode/symbols/classify.hpp"
#include "core/decode/symbols/grey_moments.hpp"

namespace slsd {

/// The result of aligning a symbol's letter with the frame.
enum class Aligned : std::uint8_t {
  kNot,
  kPrinted,  ///< not aligned, but its cell is dark wherever its letter is: print may have split it
  kWhole,    ///< aligned, and whole apart from print
  kAtEdge,   ///< aligned, but partly missing, or lit where its letter is dark, as at an edge in depth
};

[[nodiscard]] constexpr bool is_aligned(Aligned how) {
  return how == Aligned::kWhole || how == Aligned::kAtEdge;
}

/// The regions that may be symbols, and the results of the stages: one entry for each, at the same index.
struct Sightings {
  std::vector<std::int32_t> region;  ///< index in Regions
  std::vector<GreyMoments> moments;
  std::vector<Classification> shapes;
  std::vector<GridNode> nodes;
  std::vector<CellClaim> claims;
  std::vector<Aligned> aligned;
  std::vector<float> misfits;  ///< distances from their cells' letters, standard deviations, if review measured them

  [[nodiscard]] std::size_t size() const { return region.size(); }
  void clear() {
    region.clear(), moments.clear(), shapes.clear(), nodes.clear(), claims.clear(), aligned.clear(), misfits.clear();
  }
};

}  // namespace slsd
