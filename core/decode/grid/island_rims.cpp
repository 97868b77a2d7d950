// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// What another surface may have lent an island at its rim: docs/decoder.md.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <Eigen/LU>

#include "core/decode/grid/islands.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {

void IslandJudge::cut(std::int32_t node, DecodeRule rule) {
  if (cut_[node] == 0) cut_by_[node] = rule;
  cut_[node] = 1;
}

/// The cells of one island, which is_left() and all that follows from it tell of.
void IslandJudge::look_at_cells(const Frame& frame, std::int32_t island) {
  if (looked_at_ == island) return;
  const auto members_of = [&](std::int32_t id) {
    return id < 0 ? std::span<const std::int32_t>()
                  : std::span<const std::int32_t>(members_).subspan(islands_[id].first, islands_[id].size);
  };
  for (const std::int32_t node : members_of(looked_at_)) holder_of(frame, node) = -1;
  for (const std::int32_t node : members_of(island)) holder_of(frame, node) = node;
  looked_at_ = island;
}

/// How far a link's step is from the one that leads to its node, along the node's epipolar line, in cells; nothing
/// where none leads to it. Depth moves nothing across the line.
std::optional<float> IslandJudge::slip_beyond(const Frame& frame, std::int32_t node, Direction d) const {
  const Direction back = opposite(d);
  const std::int32_t after = frame.beside[node][d];
  if (after < 0 || links_[node][back] != Link::kAgrees) return std::nullopt;
  const std::int32_t before = frame.beside[node][back];
  if (!own_[node].on_line || !own_[before].on_line) return std::nullopt;
  const Eigen::Vector2f bend_px =
      frame.nodes[after].centre_px - 2 * frame.nodes[node].centre_px + frame.nodes[before].centre_px;
  const CellClaim& claim = frame.claims[node];
  return (frame.nodes[node].frame.inverse() * bend_px).dot(frame.gate.way_of_line(node, claim.row, claim.column)) /
         pitch_px_;
}

/// The slip of a link of the island seen from where it leads to, against the next link further in; nothing where the
/// node is not what lies beside that one, too.
std::optional<float> IslandJudge::slip_from_within(const Frame& frame, std::int32_t node, Direction inwards) const {
  if (links_[node][inwards] != Link::kAgrees) return std::nullopt;
  const std::int32_t within = frame.beside[node][inwards];
  if (frame.beside[within][opposite(inwards)] != node) return std::nullopt;
  return slip_beyond(frame, within, opposite(inwards));
}

/// From which slip on a link leads to another surface: some times what is usual in the frame. Where epipolar lines are
/// not known, none does.
void IslandJudge::measure_slips(const Frame& frame) {
  constexpr std::size_t kSamples = 400, kSamplesMin = 20;
  constexpr float kOfMedian = 8, kLeast = 0.008F, kOffLineOfMedian = 10, kOffLineLeastPx = 0.1F;
  slip_max_ = off_line_max_px_ = std::numeric_limits<float>::infinity();
  if (!frame.gate.knows_lines()) return;
  slips_.clear(), off_lines_px_.clear();
  const std::size_t stride = std::max<std::size_t>(1, members_.size() / kSamples);
  for (std::size_t i = 0; i < members_.size(); i += stride) {
    if (links_[members_[i]] != kAllAgree) continue;
    off_lines_px_.push_back(std::abs(own_[members_[i]].off_line_px));
    for (const Direction d : {kRight, kDown})
      if (const auto slip = slip_beyond(frame, members_[i], d)) slips_.push_back(std::abs(*slip));
  }
  if (slips_.size() < kSamplesMin) return;
  slip_max_ = std::clamp(kOfMedian * median_in_place(slips_), kLeast, kOffGridSlip);
  off_line_max_px_ = std::max(kOffLineOfMedian * median_in_place(off_lines_px_), kOffLineLeastPx);
}

/// How a node at a rim fits where its island's steps lead. Another surface lies there in one of sixty cases at most
/// where the fit is tight, and in one of five where it is loose. What was put in the pattern's place lies on its grid,
/// too. What is left of two symbols has its centre off its line.
GridFit IslandJudge::grid_fit(const Frame& frame, std::int32_t node) const {
  constexpr int kTightLinks = 2;
  if (std::isinf(slip_max_)) return GridFit::kNone;
  int count = 0;
  float most = 0;
  bool beside_another = false;
  for (const Direction d : kDirections) {
    if (links_[node][d] == Link::kAgrees) {
      const auto slip = slip_from_within(frame, node, d);
      if (slip) most = std::max(most, std::abs(*slip)), ++count;
    } else if (frame.beside[node][d] >= 0) {
      beside_another |= is_of_another(frame, node, d) && !parts(frame, node, d);
    }
  }
  if (count == 0 || most > slip_max_) return GridFit::kNone;
  const bool tight = count >= kTightLinks && !beside_another && most <= tight_slip() && !is_off_line(node);
  return tight ? GridFit::kTight : GridFit::kLoose;
}

/// Nodes that too little holds, in so many rounds as a row of symbols is long that chance could not add.
void IslandJudge::cut_back(const Frame& frame) {
  const int rounds = static_cast<int>(std::ceil(-std::log(options_.wrong_cells_max) / log_letters_ / 1.5));
  constexpr int kHeldBy = 2;
  held_.resize(frame.nodes.size());
  queue_.clear();
  for (const std::int32_t node : members_) {
    held_[node] = 4;
    if (links_[node] != kAllAgree) {
      held_[node] = 0;
      for (const Direction d : kDirections) {
        const Link link = links_[node][d];
        if (link == Link::kAgrees) ++held_[node];
        // What is well seen and contradicts is other light, which seldom is a symbol wide.
        if (link == Link::kAgainst && !runs_along_edge(frame, node, d) && !parts(frame, node, d))
          held_[node] =
              static_cast<std::int8_t>(held_[node] - (frame.shapes[frame.beside[node][d]].is_well_seen() ? 2 : 1));
      }
    }
    if (cut_[node] != 0) queue_.push_back(node);
  }
  // A node that is cut holds its neighbours no longer.
  const auto let_go = [&](std::int32_t node) {
    for (const Direction d : kDirections) {
      const std::int32_t other = frame.beside[node][d];
      if (other < 0 || island_of_[other] < 0 || frame.beside[other][opposite(d)] != node) continue;
      held_[other] = static_cast<std::int8_t>(held_[other] - (links_[other][opposite(d)] == Link::kAgrees));
    }
  };
  for (int round = 0; round < rounds; ++round) {
    for (const std::int32_t node : queue_) let_go(node);
    queue_.clear();
    for (const std::int32_t node : members_)
      if (held_[node] < kHeldBy && cut_[node] == 0) queue_.push_back(node);
    if (queue_.empty()) return;
    for (const std::int32_t node : queue_) cut(node, DecodeRule::kHeldByFew);
  }
}

/// How far a link's step is from the one behind it, in cells, beyond what a surface explains that turns away: each step
/// of its differs from the next by up to three times what that does from the one after it.
float IslandJudge::bend_of(const Frame& frame, std::int32_t node, Direction d) const {
  constexpr float kGrowth = 3;
  // The place of one that is off its line says nothing.
  const auto goes_on = [&](std::int32_t from) {
    return links_[from][d] == Link::kAgrees && own_[from].on_line && own_[frame.beside[from][d]].on_line;
  };
  const auto way = [&](std::int32_t from) -> Eigen::Vector2f {
    return frame.nodes[frame.beside[from][d]].centre_px - frame.nodes[from].centre_px;
  };
  const std::int32_t other = frame.beside[node][d];
  if (!goes_on(node) || !goes_on(other)) return 0;
  const std::int32_t next = frame.beside[other][d];
  const Eigen::Vector2f behind = way(other), bend = way(node) - behind;
  const float before = goes_on(next) ? bend.normalized().dot(behind - way(next)) : 0;
  return std::max(0.F, bend.norm() - kGrowth * std::max(0.F, before)) / behind.norm();
}

/// Whether a link leads to what is none of the island: its letter contradicts, or is well seen and has been refused.
bool IslandJudge::is_of_another(const Frame& frame, std::int32_t node, Direction d) const {
  if (links_[node][d] != Link::kNeutral) return links_[node][d] == Link::kAgainst;
  return !continues(frame, node, d) && frame.shapes[frame.beside[node][d]].is_well_seen();
}

/// Calls visit(node) for those of a piece along one of its sides, until it returns true.
template <class Visit>
bool IslandJudge::any_along(const Piece& piece, Direction d, Visit&& visit) const {
  const bool along_row = d == kUp || d == kDown;
  for (int i = 0; i < (along_row ? piece.columns : piece.rows); ++i) {
    const int row = along_row ? piece.row + (d == kDown ? piece.rows - 1 : 0) : piece.row + i,
              column = along_row ? piece.column + i : piece.column + (d == kRight ? piece.columns - 1 : 0);
    if (visit(holder_[index_of(row, column)])) return true;
  }
  return false;
}

bool IslandJudge::is_held(const Piece& piece, Direction d) const {
  return any_along(piece, d, [&](std::int32_t node) { return links_[node][d] == Link::kAgrees; });
}

IslandJudge::Side IslandJudge::side_of(const Frame& frame, const Piece& piece, Direction d) const {
  Side side;
  any_along(piece, d, [&](std::int32_t node) {
    if (links_[node][d] == Link::kAgrees) side.bend += bend_of(frame, node, d), ++side.held_by;
    const auto cell = frame.claims[node].cell().beyond(d);
    const bool is_edge = parts(frame, node, d) && !frame.shapes[frame.beside[node][d]].is_torn();
    if (is_edge || !shown(cell.row, cell.column)) return false;
    side.contradicted |= is_of_another(frame, node, d);
    if (links_[node][d] == Link::kNeutral) side.beyond += ratio(frame, frame.beside[node][d], cell.row, cell.column);
    return false;
  });
  return side;
}

/// Whether a piece of an island may be of another surface: one whose rim is straight, or turns once, so that the island
/// holds the piece on one side or on two that meet. Something else lies beside it, or what holds it bends as surfaces
/// do not.
std::optional<DecodeRule> IslandJudge::may_be_apart(const Frame& frame, const Piece& piece) const {
  constexpr float kBentAway = 0.15F;  // in the mean of its links
  // Asked first, as most pieces are held on both sides.
  const auto held = [&](Direction d) { return is_held(piece, d); };
  if ((held(kLeft) && held(kRight)) || (held(kUp) && held(kDown))) return std::nullopt;
  std::array<Side, 4> sides;
  for (const Direction d : kDirections) sides[d] = side_of(frame, piece, d);
  float bend = 0, links = 0, beyond = 0;
  bool contradicted = false;
  for (const Side& side : sides) {
    bend += side.bend, links += static_cast<float>(side.held_by);
    contradicted |= side.contradicted && side.held_by == 0;
    if (side.held_by == 0) beyond += side.beyond;
  }
  const Rules& rules = options_.rules;
  if (rules.apply(DecodeRule::kPieceContradicted, contradicted)) return DecodeRule::kPieceContradicted;
  if (rules.apply(DecodeRule::kPieceDoubtful, beyond < kSpeaksAgainst)) return DecodeRule::kPieceDoubtful;
  if (rules.apply(DecodeRule::kPieceBent, bend > kBentAway * links)) return DecodeRule::kPieceBent;
  return std::nullopt;
}

/// How often the edge of an island turns at the corner above and to the left of a cell.
int IslandJudge::turns_at(int row, int column, const Piece* without) const {
  const auto member = [&](int r, int c) { return is_left(r, c) && (without == nullptr || !without->contains(r, c)); };
  const bool above_left = member(row - 1, column - 1), above_right = member(row - 1, column),
             below_left = member(row, column - 1), below_right = member(row, column);
  const int count = above_left + above_right + below_left + below_right;
  if (count == 2) return above_left == below_right ? 2 : 0;
  return count % 2;
}

/// How much oftener the edge of the island turns without a piece.
int IslandJudge::turns_without(const Piece& piece) const {
  int turns = 0;
  for (int row = piece.row; row <= piece.row + piece.rows; ++row)
    for (int column = piece.column; column <= piece.column + piece.columns; ++column)
      turns += turns_at(row, column, &piece) - turns_at(row, column, nullptr);
  return turns;
}

/// The evidence of cells for their island; nothing where one of them is none of it.
std::optional<float> IslandJudge::evidence_of(const Piece& piece) const {
  float sum = 0;
  for (int row = piece.row; row < piece.row + piece.rows; ++row) {
    for (int column = piece.column; column < piece.column + piece.columns; ++column) {
      if (!is_left(row, column)) return std::nullopt;
      sum += own_ratio(holder_[index_of(row, column)]);
    }
  }
  return sum;
}

/// Refuses a piece that may be of another surface and says too little for being of this one.
void IslandJudge::cut_piece(const Frame& frame, const Piece& piece, float missing) {
  const auto rule = may_be_apart(frame, piece);
  if (!rule) return;
  // Where the surface has a corner, another that had it would have to turn as often as an edge is overlooked.
  if (missing <= link_weight_ && turns_without(piece) > 0) return;
  for (int row = piece.row; row < piece.row + piece.rows; ++row)
    for (int column = piece.column; column < piece.column + piece.columns; ++column)
      cut(holder_[index_of(row, column)], *rule);
}

/// Looks at every piece along a row or a column, so many cells wide, that holds a node and might lack evidence.
void IslandJudge::cut_pieces_through(const Frame& frame, std::int32_t node, float evidence_min) {
  constexpr int kWidest = 3;
  const int row = frame.claims[node].row, column = frame.claims[node].column;
  for (const bool along_row : {true, false}) {
    const int along = along_row ? column : row, across = along_row ? row : column;
    const auto slice = [&](int first_across, int width, int at) {
      return along_row ? Piece{first_across, at, width, 1} : Piece{at, first_across, 1, width};
    };
    for (int width = 1; width <= kWidest; ++width) {
      for (int side = across - width + 1; side <= across; ++side) {
        float before = 0;
        beyond_.clear();  // the slices after `along`, as far as they were asked for
        for (int first = along;; --first) {
          const auto added = evidence_of(slice(side, width, first));
          if (!added || (before += *added) >= evidence_min) break;
          float evidence = before;
          for (int last = along;; ++last) {
            const int length = last - first + 1;
            cut_piece(frame, along_row ? Piece{side, first, width, length} : Piece{first, side, length, width},
                      evidence_min - evidence);
            const auto asked = static_cast<std::size_t>(last - along);
            if (asked == beyond_.size()) beyond_.push_back(evidence_of(slice(side, width, last + 1)));
            if (!beyond_[asked] || (evidence += *beyond_[asked]) >= evidence_min) break;
          }
        }
      }
    }
  }
}

void IslandJudge::cut_pieces(const Frame& frame) {
  queue_.clear();
  std::ptrdiff_t rim = 1;  // links across which chance could have led on
  for (const std::int32_t node : members_) {
    if (links_[node] == kAllAgree) continue;
    const auto ends = std::ranges::count_if(
        kDirections, [&](Direction d) { return frame.nodes[node].broken[d] || is_of_another(frame, node, d); });
    const bool off_grid = frame.claims[node].grid_fit == GridFit::kNone;
    if (ends > 0 || off_grid || std::ranges::count(links_[node], Link::kNeutral) > 0) queue_.push_back(node);
    rim += ends;
  }
  const auto evidence_min = static_cast<float>(std::log(static_cast<double>(rim) / options_.wrong_cells_max));
  for (const std::int32_t node : queue_) {
    look_at_cells(frame, island_of_[node]);
    cut_pieces_through(frame, node, evidence_min);
  }
}

/// Single symbols that are left beside what was cut, where the rim turns less often without them: the corner of
/// something put there agrees by chance.
void IslandJudge::cut_notches(const Frame& frame, std::int32_t island) {
  queue_.clear();
  const auto leave_out = [&](std::int32_t node) {
    cut(node, DecodeRule::kNotch);
    holder_of(frame, node) = -1;
    for (const std::int32_t other : frame.beside[node])
      if (other >= 0 && island_of_[other] == island && cut_[other] == 0) queue_.push_back(other);
  };
  const auto members = std::span(members_).subspan(islands_[island].first, islands_[island].size);
  if (std::ranges::none_of(members, [&](std::int32_t node) { return cut_[node] != 0; })) return;
  look_at_cells(frame, island);
  for (const std::int32_t node : members)
    if (cut_[node] != 0) leave_out(node);
  // One after the other, as each changes the rim, in the order of their cells.
  for (std::size_t asked = 0; asked < queue_.size();) {
    next_queue_.assign(queue_.begin() + static_cast<std::ptrdiff_t>(asked), queue_.end());
    asked = queue_.size();
    std::ranges::sort(next_queue_, {},
                      [&](std::int32_t node) { return index_of(frame.claims[node].row, frame.claims[node].column); });
    for (const std::int32_t node : next_queue_) {
      const CellClaim& claim = frame.claims[node];
      if (cut_[node] != 0) continue;
      const bool is_notch = turns_without({claim.row, claim.column, 1, 1}) < 0;
      if (options_.rules.apply(DecodeRule::kNotch, is_notch)) leave_out(node);
    }
  }
  cut_steps(frame);
}

/// Symbols of queue_ that the island holds on two sides that meet, from which too few that agree, and were cut, lead on
/// to a contradiction: any of them may be the first of something else, as may what comes before those that are cut so.
void IslandJudge::cut_steps(const Frame& frame) {
  constexpr float kFewAgree = 3.5F;
  const auto is_cut = [&](std::int32_t node, Direction d) {
    return links_[node][d] == Link::kAgrees && cut_[frame.beside[node][d]] != 0;
  };
  const auto held = [&](std::int32_t node, Direction d) {
    return links_[node][d] == Link::kAgrees && cut_[frame.beside[node][d]] == 0;
  };
  const auto leads_to_another = [&](std::int32_t node, Direction d) {
    if (!is_cut(node, d)) return false;
    float evidence = own_ratio(node);
    std::int32_t last = node;
    while (is_cut(last, d)) last = frame.beside[last][d], evidence += own_ratio(last);
    return evidence < kFewAgree * log_letters_ && links_[last][d] != Link::kAgrees && is_of_another(frame, last, d) &&
           !parts(frame, last, d);
  };
  for (std::size_t asked = 0; asked < queue_.size();) {
    next_queue_.clear();
    for (const std::size_t end = queue_.size(); asked < end; ++asked) {
      const std::int32_t node = queue_[asked];
      if (cut_[node] != 0) continue;
      if ((held(node, kLeft) && held(node, kRight)) || (held(node, kUp) && held(node, kDown))) continue;
      for (const Direction d : kDirections) {
        if (!options_.rules.apply(DecodeRule::kStep, leads_to_another(node, d))) continue;
        next_queue_.push_back(node);
        if (held(node, opposite(d))) queue_.push_back(frame.beside[node][opposite(d)]);
      }
    }
    for (const std::int32_t node : next_queue_) cut(node, DecodeRule::kStep);
  }
}

void IslandJudge::cut_rims(const Frame& frame) {
  cut_.assign(frame.nodes.size(), 0);
  cut_by_.resize(frame.nodes.size());
  holder_.assign(static_cast<std::size_t>(options_.rows) * options_.columns, -1);
  looked_at_ = -1;
  around_.assign(holder_.size(), -1);
  measure_slips(frame);
  const auto may_come_to_rim = [&](std::int32_t node) {
    return links_[node] != kAllAgree ||
           std::ranges::any_of(frame.beside[node], [&](std::int32_t other) { return links_[other] != kAllAgree; });
  };
  for (const std::int32_t node : members_)
    if (may_come_to_rim(node)) frame.claims[node].grid_fit = grid_fit(frame, node);
  for (std::size_t id = 0; id < islands_.size(); ++id) cut_slid(frame, static_cast<std::int32_t>(id));
  cut_contradicted_lines(frame);
  if (options_.rules.has(DecodeRule::kHeldByFew)) cut_back(frame);
  cut_pieces(frame);
  for (std::size_t id = 0; id < islands_.size(); ++id) cut_notches(frame, static_cast<std::int32_t>(id));
}

}  // namespace slsd
