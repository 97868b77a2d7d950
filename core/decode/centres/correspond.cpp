// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/correspond.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/decode/centres/read_border.hpp"

namespace slsd {
namespace {

/// What became of the nodes along a node's row and column.
class Surroundings {
 public:
  Surroundings(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes,
               const std::vector<CellClaim>& claims, const CorrespondOptions& options, const Eigen::Vector2f& frame_px)
      : nodes_(nodes), shapes_(shapes), claims_(claims), options_(options), frame_px_(frame_px) {}

  /// Those beside it stand, and their cells lie beside its own.
  [[nodiscard]] bool goes_on_all_around(std::int32_t node) const {
    return std::ranges::all_of(kDirections, [&](Direction d) { return decoded_beside(nodes_, claims_, node, d) >= 0; });
  }

  /// At a rim, beside more that was refused than stands, seen from the row within: its links lead on where those of a
  /// row that an edge runs through are broken. Not what fits the grid tightly: no edge runs there.
  [[nodiscard]] bool is_lone(std::int32_t node) const {
    return claims_[node].grid_fit != GridFit::kTight &&
           std::ranges::any_of(kDirections, [&](Direction outwards) { return is_lone_from_within(node, outwards); });
  }

  /// At a rim, on a torn line: an edge runs along it, unless it lies between two that stand and are on none. What such
  /// an edge leaves whole are those whose letters are the same on both sides of it, which tells nothing of the side.
  /// What fits the grid tightly lies on its island's side.
  [[nodiscard]] bool is_on_torn_line(std::int32_t node) const {
    if (claims_[node].grid_fit == GridFit::kTight) return false;
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      const auto is_sound = [&](Direction d) {
        const std::int32_t other = beside(node, d);
        return stands(node, other) && (claims_[other].grid_fit == GridFit::kTight || !is_torn_along(other, forth));
      };
      const auto aside = static_cast<Direction>((forth + 1) % 4);
      return is_torn_along(node, forth) && !(is_sound(aside) && is_sound(opposite(aside)));
    });
  }

  /// The one that is left of such a line, though what is above and below stands.
  [[nodiscard]] bool is_bridge(std::int32_t node) const {
    constexpr int kFar = 4, kTornMin = 4, kTornMinOffGrid = 3;
    const GridFit fit = claims_[node].grid_fit;
    if (fit == GridFit::kTight) return false;
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      const Line line = look_along(node, forth, kFar);
      return line.standing == 0 && line.torn >= (fit == GridFit::kNone ? kTornMinOffGrid : kTornMin);
    });
  }

  /// The last of a line that has been refused, beside what is none of its island or has been refused, too.
  [[nodiscard]] bool is_last(std::int32_t node) const {
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      for (const Direction d : {forth, opposite(forth)})
        if (const std::int32_t other = beside(node, d); other < 0 || stands(node, other)) return false;
      const auto one = static_cast<Direction>((forth + 1) % 4), two = opposite(one);
      return contradicts(node, one) || contradicts(node, two) ||
             (!stands(node, beside(node, one)) && !stands(node, beside(node, two)));
    });
  }

  /// All that is left of a line, as far as it is looked at.
  [[nodiscard]] bool is_left(std::int32_t node) const {
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      int refused = 0;
      for (const Direction d : {forth, opposite(forth)}) {
        std::int32_t other = beside(node, d);
        for (int i = 0; i < kReach && other >= 0; ++i, other = beside(other, d), ++refused)
          if (stands(node, other)) return false;
      }
      return refused > kReach;
    });
  }

  /// Of the few that are left of a line, with nothing of their island on one side of them, and there, or among the
  /// refused ones, something that is none of it. The line ends with as many refused ones, with none, or with a torn
  /// one: an edge along the line tears those whose halves are of other letters.
  [[nodiscard]] bool is_rest(std::int32_t node) const {
    const bool may_be_apart = claims_[node].grid_fit != GridFit::kTight;
    return std::ranges::any_of(kDirections, [&](Direction aside) {
      if (stands(node, beside(node, aside))) return false;
      int length = 1, most_refused = 0;
      bool others = is_beside_others(node, aside);
      for (const int turn : {1, 3}) {
        const auto along = static_cast<Direction>((aside + turn) % 4);
        std::int32_t other = beside(node, along);
        for (; stands(node, other) && !stands(node, beside(other, aside)); other = beside(other, along)) {
          others |= is_beside_others(other, aside);
          ++length;
        }
        int refused = 0;
        for (; refused < kReach && other >= 0 && !stands(node, other); other = beside(other, along)) {
          others |= may_be_apart && misread(other);
          refused = shapes_[other].is_torn() ? kReach : refused + 1;
        }
        if (refused < kReach && other >= 0) return false;
        most_refused = std::max(most_refused, refused);
      }
      return others && length <= most_refused;
    });
  }

  /// All of those beside it stand.
  [[nodiscard]] bool is_inside(std::int32_t node) const {
    return std::ranges::all_of(kDirections, [&](Direction d) { return stands(node, beside(node, d)); });
  }

  /// None of those beside it stands.
  [[nodiscard]] bool is_alone(std::int32_t node) const {
    return std::ranges::none_of(kDirections, [&](Direction d) { return stands(node, beside(node, d)); });
  }

  /// With one other that stands, which has nothing else beside it either. Not where one fits the grid tightly.
  [[nodiscard]] bool is_of_pair(std::int32_t node) const {
    const std::int32_t other = only_one_beside(node);
    return other >= 0 && only_one_beside(other) == node && claims_[node].grid_fit != GridFit::kTight &&
           claims_[other].grid_fit != GridFit::kTight;
  }

  /// At the corner of what was put there: on two sides that meet, and between them, it has been refused; or on one of
  /// them something else lies or it has been refused, and on the other the frame ends.
  /// @param at_border  asks for the latter
  [[nodiscard]] bool is_corner(std::int32_t node, bool at_border) const {
    return std::ranges::any_of(kDirections, [&](Direction one) {
      const auto two = static_cast<Direction>((one + 1) % 4);
      const std::int32_t first = beside(node, one), second = beside(node, two);
      if (stands(node, beside(first, two)) || stands(node, beside(second, one))) return false;
      const auto may_be_other = [&](std::int32_t other, Direction d) {
        return is_refused(other) || contradicts(node, d);
      };
      if (!at_border) return misread(first) && misread(second);
      return (is_unread(node, one) && may_be_other(second, two)) || (is_unread(node, two) && may_be_other(first, one));
    });
  }

 private:
  static constexpr int kReach = 3;
  /// There lies what is none of its island, what is misread, or what is not read.
  [[nodiscard]] bool is_beside_others(std::int32_t node, Direction d) const {
    return contradicts(node, d) || misread(beside(node, d)) || is_unread(node, d);
  }
  /// The border of the frame cuts the symbol there, or hides it.
  [[nodiscard]] bool is_unread(std::int32_t node, Direction d) const {
    const GridNode& from = nodes_[node];
    const CellClaim::Cell cell = claims_[node].cell().beyond(d);
    const bool shown = cell.row >= 0 && cell.column >= 0 && cell.row < options_.rows && cell.column < options_.columns;
    if (from.links[d] >= 0 || !shown) return false;
    const Eigen::Vector2f there = from.centre_px + options_.pitch_px * (from.frame * step(d));
    return is_at_border(there, from.frame, options_.symbol_size_px, frame_px_);
  }
  /// Damaged, or moved off its line as print does it.
  [[nodiscard]] bool is_worn(std::int32_t node) const {
    const RegionStatus status = claims_[node].status;
    return status == RegionStatus::kDamagedShape || status == RegionStatus::kOffEpipolarLine;
  }
  /// Its letter is another than its cell's.
  [[nodiscard]] bool misread(std::int32_t node) const {
    return node >= 0 && claims_[node].status == RegionStatus::kClassDisagrees;
  }

  /// It may be of something else.
  [[nodiscard]] bool is_refused(std::int32_t node) const {
    return node >= 0 && (misread(node) || claims_[node].status == RegionStatus::kNeighboursDisagree);
  }

  [[nodiscard]] bool stands(std::int32_t node, std::int32_t other) const {
    return other >= 0 && claims_[other].status == RegionStatus::kDecoded &&
           claims_[other].island == claims_[node].island;
  }
  [[nodiscard]] std::int32_t beside(std::int32_t node, Direction d) const { return neighbour(nodes_, node, d); }
  /// The next of a line; beyond a broken link, too, where it is torn, or, for what is off the grid, has no cell: an
  /// edge breaks the links of what it tears, and along a picket those to the rest of it.
  [[nodiscard]] std::int32_t next_along(std::int32_t node, Direction d, bool is_off_grid) const {
    const std::int32_t other = nodes_[node].links[d];
    if (other < 0 || !nodes_[node].broken[d]) return other;
    return shapes_[other].is_torn() || (is_off_grid && !claims_[other].named()) ? other : -1;
  }

  /// Whether a node's cell lies beside another's as the nodes do.
  [[nodiscard]] bool fits(std::int32_t node, std::int32_t other, Direction d) const {
    return claims_[node].fits(claims_[other], d);
  }

  [[nodiscard]] bool contradicts(std::int32_t node, Direction d) const {
    const std::int32_t other = beside(node, d);
    return other >= 0 && !fits(node, other, d);
  }

  /// The one beside it that stands, or -1 where none does, or more do.
  [[nodiscard]] std::int32_t only_one_beside(std::int32_t node) const {
    std::int32_t found = -1;
    for (const Direction d : kDirections) {
      const std::int32_t other = beside(node, d);
      if (!stands(node, other)) continue;
      if (found >= 0) return -1;
      found = other;
    }
    return found;
  }

  /// What a line shows to both sides of a node.
  struct Line {
    int standing = 0, well_seen = 0;  // of what stands
    int torn = 0, worn = 0;           // torn, misread or of no cell; of these, those of their cells' letters
  };
  [[nodiscard]] Line look_along(std::int32_t node, Direction forth, int far) const {
    const bool is_off_grid = claims_[node].grid_fit == GridFit::kNone;
    Line line;
    for (const Direction d : {forth, opposite(forth)}) {
      std::int32_t at = next_along(node, d, is_off_grid);
      for (int i = 0; i < far && at >= 0; ++i, at = next_along(at, d, is_off_grid)) {
        if (stands(node, at)) {
          ++line.standing, line.well_seen += shapes_[at].is_well_seen();
        } else {
          const bool torn = shapes_[at].is_torn();
          line.torn += torn || misread(at) || !claims_[at].named(), line.worn += torn && is_worn(at);
        }
      }
    }
    return line;
  }

  /// More of its line are torn or misread than stand and are well seen. Print tears, too, so what has its cell's letter
  /// none the less counts half.
  [[nodiscard]] bool is_torn_along(std::int32_t node, Direction forth) const {
    constexpr int kFar = 8, kTornMin = 4;
    const Line line = look_along(node, forth, kFar);
    const int halves = 2 * line.torn - line.worn;
    return halves >= 2 * kTornMin && halves > 2 * (line.well_seen + shapes_[node].is_well_seen());
  }

  /// What is worn counts half, as the symbols at a limb are, too; beside what fits the grid loosely only where it is
  /// torn.
  [[nodiscard]] bool is_lone_from_within(std::int32_t node, Direction outwards) const {
    const std::int32_t within = beside(node, opposite(outwards));
    if (!stands(node, within) || stands(node, beside(node, outwards))) return false;
    const bool is_off_grid = claims_[node].grid_fit == GridFit::kNone;
    const auto weight_of = [&](std::int32_t other) {
      if (!is_worn(other)) return 2;
      return is_off_grid || shapes_[other].is_torn() ? 1 : 0;
    };
    int standing = 0, refused = 0;
    for (const int turn : {1, 3}) {
      const auto along = static_cast<Direction>((outwards + turn) % 4);
      std::int32_t before = within;
      for (int i = 0; i < kReach; ++i) {
        const std::int32_t at = beside(before, along);
        if (at < 0 || !fits(before, at, along)) break;
        before = at;
        const std::int32_t other = nodes_[at].links[outwards];
        if (other < 0) continue;
        if (stands(node, other) && !nodes_[at].broken[outwards]) {
          standing += 2;
        } else {
          refused += weight_of(other);
        }
      }
    }
    return refused > standing;
  }

  const std::vector<GridNode>& nodes_;
  const std::vector<Classification>& shapes_;
  const std::vector<CellClaim>& claims_;
  const CorrespondOptions& options_;
  const Eigen::Vector2f frame_px_;
};

/// The rule that refuses one of those that are left of a rim, or kWindows.
DecodeRule rule_of_left(const Surroundings& around, const Rules& rules, std::int32_t node) {
  if (around.is_inside(node)) return DecodeRule::kWindows;
  if (rules.apply(DecodeRule::kAlone, around.is_alone(node))) return DecodeRule::kAlone;
  if (rules.apply(DecodeRule::kLastOfLine, around.is_last(node))) return DecodeRule::kLastOfLine;
  if (rules.apply(DecodeRule::kLeftOfLine, around.is_left(node))) return DecodeRule::kLeftOfLine;
  if (rules.apply(DecodeRule::kRestOfLine, around.is_rest(node))) return DecodeRule::kRestOfLine;
  if (rules.apply(DecodeRule::kOnTornLine, around.is_on_torn_line(node))) return DecodeRule::kOnTornLine;
  if (rules.apply(DecodeRule::kBridge, around.is_bridge(node))) return DecodeRule::kBridge;
  if (rules.apply(DecodeRule::kPair, around.is_of_pair(node))) return DecodeRule::kPair;
  return DecodeRule::kWindows;
}

}  // namespace

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
    constexpr auto kTwice = DecodeRule::kCellTwice;
    if (options_.rules.apply(kTwice, lead > -options_.evidence_margin)) other.decide(kTwice);
    if (options_.rules.apply(kTwice, lead < options_.evidence_margin)) claim.decide(kTwice);
    if (lead > 0) holder = static_cast<std::int32_t>(node);
  }
}

void Correspondence::refuse_lone(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes,
                                 const Eigen::Vector2f& frame_px, Executor& executor, std::vector<CellClaim>& claims) {
  const Surroundings around(nodes, shapes, claims, options_, frame_px);
  // Most are surrounded by their own, and then none of the following can be.
  at_rim_.resize(nodes.size());
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t node = first; node < last; ++node) {
      at_rim_[node] =
          claims[node].status == RegionStatus::kDecoded && !around.goes_on_all_around(static_cast<std::int32_t>(node));
    }
  });
  rim_.clear();
  for (std::size_t node = 0; node < nodes.size(); ++node)
    if (at_rim_[node] != 0) rim_.push_back(static_cast<std::int32_t>(node));
  // All are asked before any is refused; what lies beside those is then at the rim.
  const auto refuse = [&](auto&& asked) {
    refused_.resize(rim_.size());
    executor.run_ranges(rim_.size(), [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) refused_[i] = asked(rim_[i]);
    });
    next_rim_.clear();
    bool any = false;
    for (std::size_t i = 0; i < rim_.size(); ++i) {
      if (refused_[i] == DecodeRule::kWindows) {
        next_rim_.push_back(rim_[i]);
        continue;
      }
      claims[rim_[i]].decide(refused_[i]);
      any = true;
      for (const Direction d : kDirections) {
        const std::int32_t other = neighbour(nodes, rim_[i], d);
        if (other < 0 || at_rim_[other] != 0 || claims[other].status != RegionStatus::kDecoded) continue;
        at_rim_[other] = 1;
        next_rim_.push_back(other);
      }
    }
    std::swap(rim_, next_rim_);
    return any;
  };
  const Rules& rules = options_.rules;
  refuse([&](std::int32_t node) {
    return rules.apply(DecodeRule::kRefusedAround, around.is_lone(node)) ? DecodeRule::kRefusedAround
                                                                         : DecodeRule::kWindows;
  });
  refuse([&](std::int32_t node) {
    if (rules.apply(DecodeRule::kCornerMisread, around.is_corner(node, false))) return DecodeRule::kCornerMisread;
    if (rules.apply(DecodeRule::kCornerAtBorder, around.is_corner(node, true))) return DecodeRule::kCornerAtBorder;
    return DecodeRule::kWindows;
  });
  while (refuse([&](std::int32_t node) { return rule_of_left(around, rules, node); })) continue;
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
      if (options_.rules.apply(DecodeRule::kSymbolOffLine, off_line)) {
        claim.decide(DecodeRule::kSymbolOffLine);
      } else if (options_.rules.apply(DecodeRule::kSymbolOutOfRange, out_of_range)) {
        claim.decide(DecodeRule::kSymbolOutOfRange);
      }
    }
  });
  settle_duplicates(cells, claims);
}

}  // namespace slsd
