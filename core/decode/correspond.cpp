// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/correspond.hpp"

#include <cmath>

namespace slsd {

void Correspondence::settle_duplicates(const CellRays& cells, std::vector<CellClaim>& claims) {
  holder_.assign(static_cast<std::size_t>(cells.rows()) * cells.columns(), -1);
  for (std::size_t node = 0; node < claims.size(); ++node) {
    CellClaim& claim = claims[node];
    if (claim.status != RegionStatus::kDecoded) continue;
    std::int32_t& holder = holder_[static_cast<std::size_t>(claim.row) * cells.columns() + claim.column];
    if (holder < 0) {
      holder = static_cast<std::int32_t>(node);
      continue;
    }
    CellClaim& other = claims[holder];
    const float lead = claim.evidence - other.evidence;
    if (lead > -options_.evidence_margin) other.status = RegionStatus::kDuplicateCell;
    if (lead < options_.evidence_margin) claim.status = RegionStatus::kDuplicateCell;
    if (lead > 0) holder = static_cast<std::int32_t>(node);
  }
}

void Correspondence::correspond(const CellRays& cells, std::span<const EpipolarSegment> segments,
                                std::vector<CellClaim>& claims) {
  for (std::size_t node = 0; node < claims.size(); ++node) {
    CellClaim& claim = claims[node];
    if (claim.status != RegionStatus::kDecoded) continue;
    const Eigen::Vector2d& direction = cells.ray(claim.row, claim.column).direction;
    if (std::abs(segments[node].residual_px(direction)) > options_.epipolar_max_px) {
      claim.status = RegionStatus::kOffEpipolarLine;
    } else if (!segments[node].passes(direction, options_.epipolar_max_px)) {
      claim.status = RegionStatus::kOutOfDepthRange;
    }
  }
  settle_duplicates(cells, claims);
}

}  // namespace slsd
