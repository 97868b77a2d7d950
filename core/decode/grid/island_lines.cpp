// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Rows and columns of an island that another surface may have lent it: docs/decoder.md.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/decode/grid/islands.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {

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
  return any ? -std::log(2 * kTightSlip) : 0;
}

/// Whether most of a part of line_ lie equally far off their epipolar lines: no depth moves a surface there, so what
/// their letters name is another place.
bool IslandJudge::are_off_line(const Frame& frame, int from, int to) {
  constexpr int kFewest = 5;
  constexpr float kAlike = 0.125F, kLeastPx = 0.25F;
  if (to - from + 1 < kFewest) return false;
  off_lines_px_.clear();
  for (int i = from; i <= to; ++i) off_lines_px_.push_back(own_[line_[i]].off_line_px);
  const float middle = median_in_place(off_lines_px_);
  if (std::abs(middle) <= std::max(off_line_max_px_, kLeastPx)) return false;
  const auto is_alike = [&](std::int32_t node) {
    return frame.shapes[node].is_well_seen() && std::abs(own_[node].off_line_px - middle) < kAlike * std::abs(middle);
  };
  const auto alike = std::count_if(line_.begin() + from, line_.begin() + to + 1, is_alike);
  return 2 * alike > to - from + 1;
}

/// Keeps for every node the evidence of the line of nodes through it, as far as it agrees and so far around it, where
/// something contradicts it.
void IslandJudge::find_contradicted_lines(const Frame& frame, Direction forth, float evidence_min) {
  constexpr int kReach = 10, kBeyond = 3;
  constexpr float kUsualShare = 0.3F, kUsualShareOffGrid = 0.8F, kClean = 0.8F;
  constexpr double kUnnoticed = 0.19;  // less than what the greatest of these shares leaves
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
    // Of most, what all of it lacks is too little to make any part of it doubtful.
    const double lacking = log_letters_ * static_cast<double>(count) - line_ratios_.back();
    const int shortest = std::min(count, kReach + 1);
    if (!any_misread && !begin.contradicts && !end.contradicts && begin.doubtful == 0 && end.doubtful == 0 &&
        lacking < kUnnoticed * log_letters_ * shortest &&
        std::ranges::none_of(line_, [&](std::int32_t node) { return is_off_line(node); }))
      continue;
    slides_.clear(), slid_ratios_.clear();
    for (int i = 0; i < count; ++i) {
      const int from = std::max(i - kReach, 0), to = std::min(i + kReach, count - 1);
      const bool begins = i < kReach;
      const bool ends = i + kReach >= count;
      auto evidence = static_cast<float>(line_ratios_[to + 1] - line_ratios_[from]);
      const float length =
          static_cast<float>(to - from + 1) + (begins ? begin.doubtful : 0) + (ends ? end.doubtful : 0);
      const float usual = log_letters_ * length;
      const Rules& rules = options_.rules;
      const auto contradicted = [&]() -> std::optional<DecodeRule> {
        const bool ended = (begins && begin.contradicts) || (ends && end.contradicts);
        if (rules.apply(DecodeRule::kLineMisread, is_misread(line_[i]))) return DecodeRule::kLineMisread;
        if (rules.apply(DecodeRule::kLineContradicted, ended)) return DecodeRule::kLineContradicted;
        if (rules.apply(DecodeRule::kLineWeak, evidence < kUsualShare * usual)) return DecodeRule::kLineWeak;
        const bool off_grid = evidence < kUsualShareOffGrid * usual && is_off_grid(frame, forth, from, to);
        if (rules.apply(DecodeRule::kLineOffGrid, off_grid)) return DecodeRule::kLineOffGrid;
        return std::nullopt;
      }();
      const bool misread = any_misread && std::any_of(line_.begin() + from, line_.begin() + to + 1, is_misread);
      if (rules.apply(DecodeRule::kLineOffEpipolar, is_off_line(line_[i]) && are_off_line(frame, from, to))) {
        lines_.push_back({line_[i], line_[i], line_[i], 0, 0, DecodeRule::kLineOffEpipolar});
        continue;
      }
      if (!contradicted && !rules.apply(DecodeRule::kLineRepeats,
                                        misread && !(evidence_against_slides(frame, from, to) >= evidence_min)))
        continue;
      if (evidence > 0 && evidence < evidence_min) evidence += evidence_of_places(frame, forth, from, to);
      // As far as it agrees: what ends it may have been read as one of the island.
      int begun = i, last = i;
      while (begun > from && own_ratio(line_[begun - 1]) > 0) --begun;
      while (last < to && own_ratio(line_[last + 1]) > 0) ++last;
      auto agreeing = static_cast<float>(line_ratios_[last + 1] - line_ratios_[begun]);
      if (agreeing < kClean * log_letters_ * static_cast<float>(last - begun + 1)) agreeing = 0;
      if (evidence >= evidence_min) evidence = std::min(evidence, evidence_against_slides(frame, from, to));
      if (agreeing >= evidence_min) agreeing = std::min(agreeing, evidence_against_slides(frame, begun, last));
      lines_.push_back(
          {line_[i], line_[begun], line_[last], evidence, agreeing, contradicted.value_or(DecodeRule::kLineRepeats)});
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
  constexpr float kUnlikely = -0.3F;
  const auto members = std::span(members_).subspan(islands_[island].first, islands_[island].size);
  if (!frame.gate.knows_lines() ||
      std::ranges::all_of(members, [&](std::int32_t node) { return links_[node] == kAllAgree; }))
    return;
  Piece all{options_.rows, options_.columns, 0, 0};
  unlikely_rows_.assign(static_cast<std::size_t>(options_.rows), 0);
  unlikely_columns_.assign(static_cast<std::size_t>(options_.columns), 0);
  const auto place = [&](int row, int column, std::int32_t node) {
    if (!shown(row, column)) return;
    std::int32_t& there = around_[index_of(row, column)];
    if (there >= 0) return;
    there = node, placed_.push_back(static_cast<std::int32_t>(index_of(row, column)));
    if (ratio(frame, node, row, column) <= kUnlikely) unlikely_rows_[row] = unlikely_columns_[column] = 1;
    all.row = std::min(all.row, row), all.column = std::min(all.column, column);
    all.rows = std::max(all.rows, row + 1), all.columns = std::max(all.columns, column + 1);
  };
  placed_.clear();
  for (const std::int32_t node : members) place(frame.claims[node].row, frame.claims[node].column, node);
  for (const std::int32_t node : members) {
    if (links_[node] == kAllAgree) continue;
    for (const Direction d : kDirections) {
      const auto cell = frame.claims[node].cell().beyond(d);
      const std::int32_t other = frame.beside[node][d];
      if (other >= 0 && !continues(frame, node, d)) place(cell.row, cell.column, other);
    }
  }
  // What another surface explains better holds something that its own cell does not.
  for (int row = all.row; row < all.rows; ++row)
    if (unlikely_rows_[row] != 0) cut_slid_along(frame, island, {row, all.column, 1, all.columns - all.column});
  for (int column = all.column; column < all.columns; ++column)
    if (unlikely_columns_[column] != 0) cut_slid_along(frame, island, {all.row, column, all.rows - all.row, 1});
  for (const std::int32_t at : placed_) around_[at] = -1;
}

/// @param line  one cell wide or high
void IslandJudge::cut_slid_along(const Frame& frame, std::int32_t island, const Piece& line) {
  constexpr int kGapMax = 3;
  const int down = line.columns == 1, right = 1 - down, count = line.rows * line.columns;
  line_.clear(), own_ratios_.clear();
  std::int32_t probe = -1;
  for (int i = 0; i < count; ++i) {
    const int row = line.row + i * down, column = line.column + i * right;
    const std::int32_t node = line_.emplace_back(around_[index_of(row, column)]);
    own_ratios_.push_back(node < 0 ? 0 : ratio(frame, node, row, column));
    if (node >= 0 && island_of_[node] == island) probe = node;
  }
  if (probe < 0) return;
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
      if (!options_.rules.apply(DecodeRule::kSlid, most >= evidence_min)) return;
      for (int i = start; i < end; ++i)
        if (line_[i] >= 0 && island_of_[line_[i]] == island) cut(line_[i], DecodeRule::kSlid);
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
  const auto first = frame.claims[node].cell().beyond(d);
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
  const auto cut_along = [&](Direction forth, double count) {
    lines_.clear();
    const auto evidence_min = static_cast<float>(std::log(count / (kShareOfBudget * options_.wrong_cells_max)));
    find_contradicted_lines(frame, forth, evidence_min);
    for (const Line& line : lines_)
      if (line.evidence < evidence_min && !fits_between(frame, line, evidence_min)) cut(line.node, line.rule);
  };
  cut_along(kRight, places[1]);
  cut_along(kDown, places[0]);
}

}  // namespace slsd
