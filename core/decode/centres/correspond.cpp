// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/correspond.hpp"

#include <cmath>

namespace slsd {
void Correspondence::settle_duplicates(const CellRays& cells, std::vector<CellClaim>& claims) {
  claims_of_.assign(static_cast<std::size_t>(cells.rows()) * cells.columns(), 0);
  const auto count_of = [&](const CellClaim& claim) -> std::int32_t& {
    return claims_of_[static_cast<std::size_t>(claim.row) * cells.columns() + claim.column];
  };
  for (const CellClaim& claim : claims)
    if (claim.status == RegionStatus::kDecoded) ++count_of(claim);
  for (CellClaim& claim : claims) {
    const bool is_decoded = claim.status == RegionStatus::kDecoded;
    if (rules_.apply(DecodeRule::kCellTwice, is_decoded && count_of(claim) > 1)) claim.decide(DecodeRule::kCellTwice);
  }
}

void Correspondence::correspond(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px,
                                Executor& executor, std::vector<CellClaim>& claims) {
  executor.run_ranges(claims.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t node = first; node < last; ++node) {
      CellClaim& claim = claims[node];
      if (claim.status != RegionStatus::kDecoded) continue;
      const Eigen::Vector2d& direction = cells.ray(claim.row, claim.column).direction;
      const bool off_line = std::abs(segments[node].residual_px(direction)) > tolerance_px;
      const bool out_of_range = !off_line && !segments[node].passes(direction, tolerance_px);
      if (rules_.apply(DecodeRule::kSymbolOffLine, off_line)) {
        claim.decide(DecodeRule::kSymbolOffLine);
      } else if (rules_.apply(DecodeRule::kSymbolOutOfRange, out_of_range)) {
        claim.decide(DecodeRule::kSymbolOutOfRange);
      }
    }
  });
  settle_duplicates(cells, claims);
}

}  // namespace slsd
