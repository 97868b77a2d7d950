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
    // Of two islands nothing says which is right; within one a symbol may have been taken apart.
    const float lead = claim.island == other.island ? claim.evidence - other.evidence : 0;
    if (lead > -options_.evidence_margin) other.status = RegionStatus::kDuplicateCell;
    if (lead < options_.evidence_margin) claim.status = RegionStatus::kDuplicateCell;
    if (lead > 0) holder = static_cast<std::int32_t>(node);
  }
}

void Correspondence::refuse_lone(const std::vector<GridNode>& nodes, std::vector<CellClaim>& claims) {
  constexpr int kReach = 3;
  const auto stands = [&](std::int32_t node, std::int32_t other) {
    return other >= 0 && claims[other].status == RegionStatus::kDecoded && claims[other].island == claims[node].island;
  };
  // Whether the island goes on there, refused or not, or no node is there that could be of another surface. What was
  // refused by its surroundings could.
  const auto continues = [&](std::int32_t node, Direction d) {
    const std::int32_t other = neighbour(nodes, node, d);
    const Eigen::Vector2f to = step(d);
    return other < 0 || (claims[other].status != RegionStatus::kNeighboursDisagree &&
                         claims[other].same_cell(claims[node].row + static_cast<int>(to.y()),
                                                 claims[node].column + static_cast<int>(to.x())));
  };
  const auto is_lone = [&](std::int32_t node, Direction forth) {
    int standing = 0, refused = 0, next_refused = 0;
    for (const Direction d : {forth, opposite(forth)}) {
      std::int32_t other = neighbour(nodes, node, d);
      next_refused += other >= 0 && !stands(node, other);
      for (int i = 0; i < kReach && other >= 0; ++i, other = neighbour(nodes, other, d))
        ++(stands(node, other) ? standing : refused);
    }
    const auto aside = static_cast<Direction>((forth + 1) % 4);
    const bool inside = continues(node, aside) && continues(node, opposite(aside));
    return inside ? refused == 2 * kReach : refused > standing || next_refused == 2;
  };
  lone_.clear();
  for (std::int32_t node = 0; node < static_cast<std::int32_t>(nodes.size()); ++node) {
    if (claims[node].status != RegionStatus::kDecoded) continue;
    if (is_lone(node, kRight) || is_lone(node, kDown)) lone_.push_back(node);
  }
  for (const std::int32_t node : lone_) claims[node].status = RegionStatus::kNeighboursDisagree;
}

void Correspondence::correspond(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px,
                                std::vector<CellClaim>& claims) {
  for (std::size_t node = 0; node < claims.size(); ++node) {
    CellClaim& claim = claims[node];
    if (claim.status != RegionStatus::kDecoded) continue;
    const Eigen::Vector2d& direction = cells.ray(claim.row, claim.column).direction;
    if (std::abs(segments[node].residual_px(direction)) > tolerance_px) {
      claim.status = RegionStatus::kOffEpipolarLine;
    } else if (!segments[node].passes(direction, tolerance_px)) {
      claim.status = RegionStatus::kOutOfDepthRange;
    }
  }
  settle_duplicates(cells, claims);
}

}  // namespace slsd
