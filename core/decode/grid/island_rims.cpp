// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// What another surface may have lent an island at its rim: docs/decoder.md.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <Eigen/LU>

#include "core/decode/grid/islands.hpp"

namespace slsd {

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
  constexpr float kOfMedian = 8, kLeast = 0.008F, kMost = 0.1F;
  slip_max_ = std::numeric_limits<float>::infinity();
  if (!frame.gate.knows_lines()) return;
  slips_.clear();
  const std::size_t stride = std::max<std::size_t>(1, members_.size() / kSamples);
  for (std::size_t i = 0; i < members_.size(); i += stride) {
    if (links_[members_[i]] != kAllAgree) continue;
    for (const Direction d : {kRight, kDown})
      if (const auto slip = slip_beyond(frame, members_[i], d)) slips_.push_back(std::abs(*slip));
  }
  if (slips_.size() < kSamplesMin) return;
  const auto middle = slips_.begin() + static_cast<std::ptrdiff_t>(slips_.size() / 2);
  std::ranges::nth_element(slips_, middle);
  slip_max_ = std::clamp(kOfMedian * *middle, kLeast, kMost);
}

/// How a node at a rim fits where its island's steps lead. Another surface lies there in one of sixty cases at most
/// where the fit is tight, and in one of five where it is loose. What was put in the pattern's place lies on its grid,
/// too.
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
  const bool tight = count >= kTightLinks && !beside_another && most <= tight_slip();
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
          held_[node] = static_cast<std::int8_t>(held_[node] - (is_well_seen(frame, frame.beside[node][d]) ? 2 : 1));
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
    for (const std::int32_t node : queue_) cut_[node] = 1;
  }
}

/// Whether a part of line_ is off the grid of what holds it on one side: most of the links across slip the same way, by
/// half of what tells another surface where it is one link. A surface that turns away slips there, too, by up to three
/// times what the links further in do.
bool IslandJudge::is_off_grid(const Frame& frame, Direction forth, int from, int to) {
  constexpr std::size_t kSlipsMin = 4;  // fewer may be torn, all of them
  constexpr float kGrowth = 3, kOfSlipMax = 0.5F;
  if (std::isinf(slip_max_)) return false;
  const float most = kOfSlipMax * slip_max_;
  for (const int side : {0, 1}) {
    const Direction inwards = across(forth, side);
    slips_.clear();
    for (int i = from; i <= to; ++i) {
      const auto slip = slip_from_within(frame, line_[i], inwards);
      if (!slip) continue;
      const auto next = slip_from_within(frame, frame.beside[line_[i]][inwards], inwards);
      const float grown = next ? kGrowth * *next : 0;
      slips_.push_back(*slip > 0 ? std::max(0.F, *slip - std::max(0.F, grown))
                                 : std::min(0.F, *slip - std::min(0.F, grown)));
    }
    if (slips_.size() < kSlipsMin) continue;
    std::ranges::sort(slips_);
    const std::size_t few = slips_.size() / 4;
    if (slips_[few] > most || slips_[slips_.size() - 1 - few] < -most) return true;
  }
  return false;
}

/// What the places of a part of line_ say for it, apart from its letters: where all of them lie on the grid of those on
/// both sides, another surface hardly ever does. Once, however many they are, as it lies at one depth.
float IslandJudge::evidence_of_places(const Frame& frame, Direction forth, int from, int to) const {
  if (std::isinf(slip_max_)) return 0;
  bool any = false;
  for (const int side : {0, 1}) {
    for (int i = from; i <= to; ++i) {
      const auto slip = slip_from_within(frame, line_[i], across(forth, side));
      if (!slip) continue;
      if (std::abs(*slip) > tight_slip()) return 0;
      any = true;
    }
  }
  return any ? -std::log(2 * kTightMost) : 0;
}

/// Keeps for every node the evidence of the line of nodes through it, as far as it agrees and so far around it, where
/// something contradicts it.
void IslandJudge::find_contradicted_lines(const Frame& frame, Direction forth, float evidence_min) {
  constexpr int kReach = 10, kBeyond = 3;
  constexpr float kUsualShare = 0.5F, kUsualShareOffGrid = 0.8F, kClean = 0.8F;
  const Direction back = opposite(forth);
  const auto leads = [&](std::int32_t node, Direction d) {
    return continues(frame, node, d) && frame.beside[frame.beside[node][d]][opposite(d)] == node;
  };
  struct End {
    bool contradicts;
    float doubtful;
  };
  const auto look_beyond = [&](std::int32_t node, Direction d) {
    const Link link = links_[node][d];
    if ((link != Link::kAgainst && link != Link::kNeutral) || parts(frame, node, d)) return End{false, 0};
    return End{link == Link::kAgainst && !runs_along_edge(frame, node, d),
               link == Link::kNeutral ? count_doubtful(frame, node, d, kBeyond) : 0};
  };
  for (const std::int32_t first : members_) {
    if (leads(first, back)) continue;
    // A misread symbol of the island is weighed with the others; what is none of it ends the line.
    line_.assign(1, first);
    line_ratios_.assign({0, own_ratio(first)});
    while (leads(line_.back(), forth)) {
      line_.push_back(frame.beside[line_.back()][forth]);
      line_ratios_.push_back(line_ratios_.back() + own_ratio(line_.back()));
    }
    const End begin = look_beyond(first, back), end = look_beyond(line_.back(), forth);
    const int count = static_cast<int>(line_.size());
    const auto is_misread = [&](std::int32_t node) { return own_ratio(node) < kSpeaksAgainst; };
    const bool any_misread = std::ranges::any_of(line_, is_misread);  // of most lines none is
    slides_.clear(), slid_ratios_.clear();
    for (int i = 0; i < count; ++i) {
      const int from = std::max(i - kReach, 0), to = std::min(i + kReach, count - 1);
      const bool begins = i - kReach<0, ends = i + kReach> count - 1;
      auto evidence = static_cast<float>(line_ratios_[to + 1] - line_ratios_[from]);
      const float length =
          static_cast<float>(to - from + 1) + (begins ? begin.doubtful : 0) + (ends ? end.doubtful : 0);
      const float usual = log_letters_ * length;
      const bool contradicted = is_misread(line_[i]) || (begins && begin.contradicts) || (ends && end.contradicts) ||
                                evidence < kUsualShare * usual ||
                                (evidence < kUsualShareOffGrid * usual && is_off_grid(frame, forth, from, to));
      const bool misread = any_misread && std::any_of(line_.begin() + from, line_.begin() + to + 1, is_misread);
      if (!contradicted && (!misread || evidence_against_slides(frame, from, to) >= evidence_min)) continue;
      if (evidence > 0 && evidence < evidence_min) evidence += evidence_of_places(frame, forth, from, to);
      // As far as it agrees: what ends it may have been read as one of the island.
      int begun = i, last = i;
      while (begun > from && own_ratio(line_[begun - 1]) > 0) --begun;
      while (last < to && own_ratio(line_[last + 1]) > 0) ++last;
      auto agreeing = static_cast<float>(line_ratios_[last + 1] - line_ratios_[begun]);
      if (agreeing < kClean * log_letters_ * static_cast<float>(last - begun + 1)) agreeing = 0;
      if (evidence >= evidence_min) evidence = std::min(evidence, evidence_against_slides(frame, from, to));
      if (agreeing >= evidence_min) agreeing = std::min(agreeing, evidence_against_slides(frame, begun, last));
      lines_.push_back({line_[i], line_[begun], line_[last], evidence, agreeing});
    }
  }
}

/// How much a part of line_ speaks for its own cells against those of another surface, which lie some step on along the
/// epipolar lines, each step as likely as the others. Where letters do not come again it says the same as against
/// chance.
float IslandJudge::evidence_against_slides(const Frame& frame, int from, int to) {
  if (!frame.gate.knows_lines()) return std::numeric_limits<float>::infinity();
  const std::size_t count = line_.size();
  if (slides_.empty()) {
    const CellClaim& claim = frame.claims[line_[count / 2]];
    frame.gate.visit_line(line_[count / 2], claim.row, claim.column, [&](int row, int column) {
      slides_.push_back({row - claim.row, column - claim.column});
    });
    for (const auto& [down, right] : slides_) {
      float sum = slid_ratios_.emplace_back(0);
      for (const std::int32_t node : line_) {
        const int row = frame.claims[node].row + down, column = frame.claims[node].column + right;
        sum += shown(row, column) ? ratio(frame, node, row, column) : -log_letters_;
        slid_ratios_.push_back(sum);
      }
    }
  }
  if (slides_.empty()) return std::numeric_limits<float>::infinity();
  const auto own = static_cast<float>(line_ratios_[to + 1] - line_ratios_[from]);
  float likelihood = 0;  // of these shapes where another surface shows them, as a share of their own
  for (std::size_t slide = 0; slide < slides_.size(); ++slide) {
    const float* sums = &slid_ratios_[slide * (count + 1)];
    likelihood += std::exp(sums[to + 1] - sums[from] - own);
  }
  return -std::log(likelihood / static_cast<float>(slides_.size()));
}

/// Refuses what another surface explains better: stretches of a row or a column of the island, with what lies right
/// beside it, whose shapes fit the cells at another place on their epipolar lines, all of them moved by the same step.
void IslandJudge::cut_slid(const Frame& frame, std::int32_t island) {
  const auto members = std::span(members_).subspan(islands_[island].first, islands_[island].size);
  if (!frame.gate.knows_lines() ||
      std::ranges::all_of(members, [&](std::int32_t node) { return links_[node] == kAllAgree; }))
    return;
  Piece all{options_.rows, options_.columns, 0, 0};
  const auto place = [&](int row, int column, std::int32_t node) {
    if (!shown(row, column)) return;
    std::int32_t& there = around_[index_of(row, column)];
    if (there < 0) there = node, placed_.push_back(static_cast<std::int32_t>(index_of(row, column)));
    all.row = std::min(all.row, row), all.column = std::min(all.column, column);
    all.rows = std::max(all.rows, row + 1), all.columns = std::max(all.columns, column + 1);
  };
  placed_.clear();
  for (const std::int32_t node : members) place(frame.claims[node].row, frame.claims[node].column, node);
  for (const std::int32_t node : members) {
    if (links_[node] == kAllAgree) continue;
    for (const Direction d : kDirections) {
      const auto cell = frame.claims[node].beyond(d);
      const std::int32_t other = frame.beside[node][d];
      if (other >= 0 && !continues(frame, node, d)) place(cell.row, cell.column, other);
    }
  }
  for (int row = all.row; row < all.rows; ++row)
    cut_slid_along(frame, island, {row, all.column, 1, all.columns - all.column});
  for (int column = all.column; column < all.columns; ++column)
    cut_slid_along(frame, island, {all.row, column, all.rows - all.row, 1});
  for (const std::int32_t at : placed_) around_[at] = -1;
}

/// @param line  one cell wide or high
void IslandJudge::cut_slid_along(const Frame& frame, std::int32_t island, const Piece& line) {
  constexpr float kUnlikely = -0.3F;
  constexpr int kGapMax = 3;
  const int down = line.columns == 1, right = 1 - down, count = line.rows * line.columns;
  line_.clear(), own_ratios_.clear();
  std::int32_t probe = -1;
  float least = 0;
  for (int i = 0; i < count; ++i) {
    const int row = line.row + i * down, column = line.column + i * right;
    const std::int32_t node = line_.emplace_back(around_[index_of(row, column)]);
    own_ratios_.push_back(node < 0 ? 0 : ratio(frame, node, row, column));
    least = std::min(least, own_ratios_.back());
    if (node >= 0 && island_of_[node] == island) probe = node;
  }
  if (least > kUnlikely || probe < 0) return;
  const CellClaim& claim = frame.claims[probe];
  slides_.clear();
  frame.gate.visit_line(probe, claim.row, claim.column, [&](int r, int c) {
    slides_.push_back({r - claim.row, c - claim.column});
  });
  const float evidence_min = std::log(static_cast<float>(slides_.size() + 1)) + link_weight_;
  for (const auto& [slide_down, slide_right] : slides_) {
    int start = 0, end = 0, gap = 0;
    float sum = 0, most = 0;
    const auto refuse = [&] {
      if (most < evidence_min) return;
      for (int i = start; i < end; ++i)
        if (line_[i] >= 0 && island_of_[line_[i]] == island) cut_[line_[i]] = 1;
    };
    for (int i = 0; i < count; ++i) {
      gap = line_[i] < 0 ? gap + 1 : 0;
      if (line_[i] >= 0) {
        const int r = line.row + i * down + slide_down, c = line.column + i * right + slide_right;
        sum += (shown(r, c) ? ratio(frame, line_[i], r, c) : -log_letters_) - own_ratios_[i];
        if (sum >= most) most = sum, end = i + 1;
      }
      if (sum >= 0 && sum > most - 2 * log_letters_ - link_weight_ && gap <= kGapMax) continue;
      refuse();
      start = end = i + 1, sum = most = 0;
    }
    refuse();
  }
}

/// How many nodes on from the end of a line, of so many, may be its own and say nothing for it.
float IslandJudge::count_doubtful(const Frame& frame, std::int32_t node, Direction d, int most) const {
  const auto first = frame.claims[node].beyond(d);
  const int down = first.row - frame.claims[node].row, right = first.column - frame.claims[node].column;
  int row = first.row, column = first.column, count = 0;
  for (std::int32_t at = frame.beside[node][d]; at >= 0 && count < most; at = frame.beside[at][d]) {
    if (!shown(row, column) || ratio(frame, at, row, column) < kSpeaksAgainst) break;
    row += down, column += right, ++count;
  }
  return static_cast<float>(count);
}

/// Whether a line agrees from end to end, says enough by itself, and ends where the rim turns oftener without it.
bool IslandJudge::fits_between(const Frame& frame, const Line& line, float evidence_min) {
  const CellClaim &first = frame.claims[line.first], &last = frame.claims[line.last];
  const Piece piece{first.row, first.column, last.row - first.row + 1, last.column - first.column + 1};
  if (line.agreeing < evidence_min) return false;
  look_at_cells(frame, island_of_[line.node]);
  return turns_without(piece) > 0;
}

/// Lines that chance may have added: of nodes that links across them hold, in places as many as such links contradict.
void IslandJudge::cut_contradicted_lines(const Frame& frame) {
  constexpr double kUnseenPlaces = 0.3;  // in expectation, where nothing contradicts
  constexpr double kShareOfBudget = 0.3;
  std::array<double, 2> places{kUnseenPlaces, kUnseenPlaces};  // along rows, along columns
  for (const std::int32_t node : members_) {
    const Links& links = links_[node];
    if (!any_against(links)) continue;
    // What chance has added is contradicted all around.
    if (std::ranges::count(links, Link::kAgrees) < std::ranges::count(links, Link::kAgainst) + 2) continue;
    for (const Direction d : kDirections) places[d % 2] += links[d] == Link::kAgainst;
  }
  const auto cut = [&](Direction forth, double count) {
    lines_.clear();
    const auto evidence_min = static_cast<float>(std::log(count / (kShareOfBudget * options_.wrong_cells_max)));
    find_contradicted_lines(frame, forth, evidence_min);
    for (const Line& line : lines_)
      if (line.evidence < evidence_min && !fits_between(frame, line, evidence_min)) cut_[line.node] = 1;
  };
  cut(kRight, places[1]);
  cut(kDown, places[0]);
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
  return !continues(frame, node, d) && is_well_seen(frame, frame.beside[node][d]);
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
    const auto cell = frame.claims[node].beyond(d);
    if (parts(frame, node, d) && !frame.shapes[frame.beside[node][d]].is_torn()) {
      side.broken |= is_of_another(frame, node, d);
    } else if (shown(cell.row, cell.column)) {
      side.contradicted |= is_of_another(frame, node, d);
      if (links_[node][d] == Link::kNeutral) side.beyond += ratio(frame, frame.beside[node][d], cell.row, cell.column);
    }
    side.broken |= frame.nodes[node].broken[d];
    return false;
  });
  return side;
}

/// Whether a piece of an island may be of another surface: one whose rim is straight, or turns once, so that the island
/// holds the piece on one side or on two that meet. Something else lies beside it, or breaks off beside it while what
/// holds the piece is bent.
bool IslandJudge::may_be_apart(const Frame& frame, const Piece& piece) const {
  constexpr float kBent = 0.06F;  // surfaces bend by a third of it and less
  // Asked first, as most pieces are held on both sides.
  const auto held = [&](Direction d) { return is_held(piece, d); };
  if ((held(kLeft) && held(kRight)) || (held(kUp) && held(kDown))) return false;
  std::array<Side, 4> sides;
  for (const Direction d : kDirections) sides[d] = side_of(frame, piece, d);
  float bend = 0, links = 0, beyond = 0;
  bool contradicted = false, broken = false;
  for (const Side& side : sides) {
    bend += side.bend, links += static_cast<float>(side.held_by);
    contradicted |= side.contradicted && side.held_by == 0;
    broken |= side.broken && side.held_by == 0;
    if (side.held_by == 0) beyond += side.beyond;
  }
  return contradicted || beyond < kSpeaksAgainst || (broken && bend > kBent * links);
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
  if (!may_be_apart(frame, piece)) return;
  // Where the surface has a corner, another that had it would have to turn as often as an edge is overlooked.
  if (missing <= link_weight_ && turns_without(piece) > 0) return;
  for (int row = piece.row; row < piece.row + piece.rows; ++row)
    for (int column = piece.column; column < piece.column + piece.columns; ++column)
      cut_[holder_[index_of(row, column)]] = 1;
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
    if (ends > 0 || std::ranges::count(links_[node], Link::kNeutral) > 0) queue_.push_back(node);
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
  const auto cut = [&](std::int32_t node) {
    cut_[node] = 1;
    holder_of(frame, node) = -1;
    for (const std::int32_t other : frame.beside[node])
      if (other >= 0 && island_of_[other] == island && cut_[other] == 0) queue_.push_back(other);
  };
  const auto members = std::span(members_).subspan(islands_[island].first, islands_[island].size);
  if (std::ranges::none_of(members, [&](std::int32_t node) { return cut_[node] != 0; })) return;
  look_at_cells(frame, island);
  for (const std::int32_t node : members)
    if (cut_[node] != 0) cut(node);
  // One after the other, as each changes the rim, in the order of their cells.
  for (std::size_t asked = 0; asked < queue_.size();) {
    next_queue_.assign(queue_.begin() + static_cast<std::ptrdiff_t>(asked), queue_.end());
    asked = queue_.size();
    std::ranges::sort(next_queue_, {},
                      [&](std::int32_t node) { return index_of(frame.claims[node].row, frame.claims[node].column); });
    for (const std::int32_t node : next_queue_) {
      const CellClaim& claim = frame.claims[node];
      if (cut_[node] == 0 && turns_without({claim.row, claim.column, 1, 1}) < 0) cut(node);
    }
  }
  cut_steps(frame);
}

/// Symbols of queue_ that the island holds on two sides that meet, from which too few that agree, and were cut, lead on
/// to a contradiction: any of them may be the first of something else.
void IslandJudge::cut_steps(const Frame& frame) {
  constexpr float kFewAgree = 3.5F;
  const auto is_cut = [&](std::int32_t node, Direction d) {
    return links_[node][d] == Link::kAgrees && cut_[frame.beside[node][d]] != 0;
  };
  const auto held = [&](std::int32_t node, Direction d) {
    return links_[node][d] == Link::kAgrees && cut_[frame.beside[node][d]] == 0;
  };
  next_queue_.clear();
  for (const std::int32_t node : queue_) {
    if (cut_[node] != 0) continue;
    if ((held(node, kLeft) && held(node, kRight)) || (held(node, kUp) && held(node, kDown))) continue;
    for (const Direction d : kDirections) {
      if (!is_cut(node, d)) continue;
      float evidence = own_ratio(node);
      std::int32_t last = node;
      while (is_cut(last, d)) last = frame.beside[last][d], evidence += own_ratio(last);
      const bool ends = links_[last][d] != Link::kAgrees && is_of_another(frame, last, d) && !parts(frame, last, d);
      if (ends && evidence < kFewAgree * log_letters_) next_queue_.push_back(node);
    }
  }
  for (const std::int32_t node : next_queue_) cut_[node] = 1;
}

void IslandJudge::cut_rims(const Frame& frame) {
  cut_.assign(frame.nodes.size(), 0);
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
  cut_back(frame);
  cut_pieces(frame);
  for (std::size_t id = 0; id < islands_.size(); ++id) cut_notches(frame, static_cast<std::int32_t>(id));
}

}  // namespace slsd
