// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/islands.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace slsd {

/// No branch for each of the four: most nodes have none.
bool IslandJudge::any_against(const Links& links) {
  static_assert(static_cast<int>(Link::kAgainst) == 3);
  const auto bits = std::bit_cast<std::uint32_t>(links);
  return (bits & bits >> 1U & 0x01010101U) != 0;
}

IslandJudge::IslandJudge(const Pattern& pattern, IslandOptions options)
    : array_(pattern.array),
      options_(options),
      log_letters_(std::log(static_cast<float>(pattern.letters()))),
      link_weight_(static_cast<float>(-std::log(options.link_crosses))),
      pitch_px_(static_cast<float>(pattern.pitch_px())) {}

float IslandJudge::ratio(const Frame& frame, std::int32_t node, int row, int column) const {
  const Classification& shape = frame.shapes[node];
  return shape.letter < 0 ? 0 : shape.log_probability[array_.at(row, column)] + log_letters_;
}

/// The best of the cells that a node's neighbours put it on, if it is better than the next. One that print has moved
/// off its line, and that shows the letter, is its island's even so: left out, it would part those around it.
bool IslandJudge::adopt(const Frame& frame, std::int32_t node, CellClaim& adopted) const {
  struct Candidate {
    int row, column, links;
    float ratio;
  };
  constexpr float kAstray = 0.2F;  // of the pitch
  const auto may_be = [&](std::int32_t at, int row, int column) {
    return frame.gate.admits(at, row, column, frame.shapes[at].is_well_seen() ? 0 : kAstray * pitch_px_);
  };
  std::array<Candidate, 4> candidates;
  int count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t other = frame.beside[node][d];
    if (other < 0 || !frame.claims[other].named()) continue;
    const auto cell = frame.claims[other].cell().beyond(opposite(d));
    if (!shown(cell.row, cell.column)) continue;
    const auto end = candidates.begin() + count;
    const auto known = std::find_if(candidates.begin(), end, [&](const Candidate& candidate) {
      return candidate.row == cell.row && candidate.column == cell.column;
    });
    if (known != end) {
      ++known->links;
      continue;
    }
    const float speaks = ratio(frame, node, cell.row, cell.column);
    const bool strays = !may_be(other, frame.claims[other].row, frame.claims[other].column);
    const bool admitted = frame.gate.admits(node, cell.row, cell.column);
    if (!strays && !admitted && !(speaks > 0 && may_be(node, cell.row, cell.column))) continue;
    candidates[count++] = {cell.row, cell.column, 1, speaks};
  }
  const Candidate* best = nullptr;
  float best_score = 0, second_score = 0;
  for (int i = 0; i < count; ++i) {
    const Candidate& candidate = candidates[i];
    const float score = candidate.ratio + link_weight_ * static_cast<float>(candidate.links);
    if (best == nullptr || score > best_score) {
      second_score = best == nullptr ? 0 : best_score;
      best = &candidate, best_score = score;
    } else {
      second_score = std::max(second_score, score);
    }
  }
  if (best == nullptr || (best->ratio <= 0 && best->links < 3) || best_score - second_score < 1) return false;
  adopted = {static_cast<std::int16_t>(best->row), static_cast<std::int16_t>(best->column)};
  adopted.decide(DecodeRule::kGrown);
  return true;
}

/// In rounds, each by what the round before knew, so that it does not matter in which order nodes stand.
void IslandJudge::grow(const Frame& frame) {
  queue_.clear();
  for (std::size_t i = 0; i < frame.nodes.size(); ++i) {
    if (frame.claims[i].named() || frame.claims[i].status == RegionStatus::kNoNeighbour) continue;
    queue_.push_back(static_cast<std::int32_t>(i));
  }
  cut_.assign(frame.nodes.size(), 0);  // here: whether a node is in the next round's queue
  while (!queue_.empty()) {
    next_queue_.clear(), adopted_.clear();
    for (const std::int32_t node : queue_) {
      if (CellClaim claim; !frame.claims[node].named() && adopt(frame, node, claim)) {
        adopted_.push_back(claim);
        next_queue_.push_back(node);
      }
    }
    queue_.clear();
    for (std::size_t i = 0; i < adopted_.size(); ++i) frame.claims[next_queue_[i]] = adopted_[i];
    for (const std::int32_t node : next_queue_) {
      for (const Direction d : kDirections) {
        const std::int32_t other = frame.beside[node][d];
        if (other >= 0 && !frame.claims[other].named()) queue_.push_back(other);
      }
    }
    std::ranges::sort(queue_);
    queue_.erase(std::unique(queue_.begin(), queue_.end()), queue_.end());  // clang 14 cannot read its ranges form
  }
}

void IslandJudge::look_at_own_cells(const Frame& frame, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i) {
    const auto node = static_cast<std::int32_t>(i);
    const CellClaim& claim = frame.claims[i];
    if (!claim.named()) {
      own_[i] = {};
      continue;
    }
    const double off_line_px = frame.gate.residual_px(node, claim.row, claim.column);
    own_[i] = {ratio(frame, node, claim.row, claim.column),
               static_cast<float>(off_line_px),
               frame.gate.on_line(off_line_px),
               frame.gate.admits(node, claim.row, claim.column),
               {}};
    for (const Direction d : kDirections) {
      const std::int32_t other = frame.beside[i][d];
      own_[i].fits[d] = other >= 0 && claim.fits(frame.claims[other], d);
    }
  }
}

void IslandJudge::find_islands(const Frame& frame) {
  island_of_.assign(frame.nodes.size(), -1);
  islands_.clear(), members_.clear();
  for (std::size_t i = 0; i < frame.nodes.size(); ++i) {
    const bool asked = frame.claims[i].named() && frame.claims[i].status == RegionStatus::kDecoded;
    if (!asked || island_of_[i] >= 0) continue;
    const auto id = static_cast<std::int32_t>(islands_.size());
    Island island{.first = static_cast<std::int32_t>(members_.size())};
    members_.push_back(static_cast<std::int32_t>(i));
    island_of_[i] = id;
    for (std::size_t at = island.first; at < members_.size(); ++at) {
      const std::int32_t node = members_[at];
      for (const Direction d : kDirections) {
        const std::int32_t other = frame.beside[node][d];
        if (!own_[node].fits[d] || island_of_[other] >= 0) continue;
        if (frame.claims[other].status != RegionStatus::kDecoded) continue;
        island_of_[other] = id;
        members_.push_back(other);
      }
    }
    island.size = static_cast<std::int32_t>(members_.size()) - island.first;
    islands_.push_back(island);
  }
}

void IslandJudge::read_links_of(const Frame& frame, std::int32_t node) {
  for (const Direction d : kDirections) {
    const std::int32_t other = frame.beside[node][d];
    if (other < 0) {
      links_[node][d] = Link::kNone;
    } else if (continues(frame, node, d)) {
      const float speaks = own_ratio(other);
      links_[node][d] = speaks > 0 ? Link::kAgrees : speaks < kSpeaksAgainst ? Link::kAgainst : Link::kNeutral;
    } else {
      links_[node][d] = read_link_out(frame, node, d);
    }
  }
}

/// One that leads to what is none of the node's island, or not as its cell lies.
IslandJudge::Link IslandJudge::read_link_out(const Frame& frame, std::int32_t node, Direction direction) const {
  const std::int32_t other = frame.beside[node][direction];
  const auto cell = frame.claims[node].cell().beyond(direction);
  if (!shown(cell.row, cell.column)) return Link::kAgainst;
  const float speaks = ratio(frame, other, cell.row, cell.column);
  // A node of another island has a surface of its own, though its letter may fit here too.
  const bool apart = island_of_[other] >= 0 && island_of_[other] != island_of_[node];
  return speaks < kSpeaksAgainst || (apart && speaks > 0) ? Link::kAgainst : Link::kNeutral;
}

void IslandJudge::read_links(const Frame& frame, Executor& executor) {
  links_.resize(frame.nodes.size());
  executor.run_ranges(members_.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) read_links_of(frame, members_[i]);
  });
}

/// Only links to nodes that are of an island no longer say something else than before.
void IslandJudge::read_links_around(const Frame& frame, const std::vector<std::int32_t>& gone) {
  for (const std::int32_t node : gone) {
    for (const std::int32_t other : frame.beside[node])
      if (other >= 0 && island_of_[other] >= 0) read_links_of(frame, other);
  }
}

/// Whether a contradiction is one of several side by side: the edge of a surface, which says nothing against the node.
/// Where the links beside agree, it stands alone.
bool IslandJudge::runs_along_edge(const Frame& frame, std::int32_t node, Direction direction) const {
  int against = 0;
  for (const int side : {0, 1}) {
    const Direction aside = across(direction, side);
    if (links_[node][aside] != Link::kAgrees) continue;
    const std::int32_t beside = frame.beside[node][aside];
    if (links_[beside][direction] == Link::kAgrees) return false;
    against += links_[beside][direction] == Link::kAgainst;
  }
  return against > 0;
}

double IslandJudge::cost_of_rim(const Frame& frame, const Island& island) const {
  constexpr double kPiece = 3, kLink = 0.1;
  double cost = 0;
  for (std::int32_t i = island.first; i < island.first + island.size; ++i) {
    const std::int32_t node = members_[i];
    if (!any_against(links_[node])) continue;
    for (const Direction d : kDirections) {
      if (links_[node][d] != Link::kAgainst) continue;
      const std::int32_t beside = frame.beside[node][across(d, 0)];
      const bool goes_on = beside >= 0 && island_of_[beside] == island_of_[node] && links_[beside][d] == Link::kAgainst;
      cost += goes_on ? kLink : kPiece;
    }
  }
  return cost;
}

void IslandJudge::weigh(const Frame& frame, Island& island) const {
  // Larger islands differ from every other place, by three letters and more in each window of theirs.
  constexpr std::int32_t kComparedMax = 150;
  const bool compares = island.size <= kComparedMax || array_.minimum_distance < 3;
  const auto members = std::span(members_).subspan(island.first, island.size);
  double evidence = 0;
  int off_line = 0;
  for (const std::int32_t node : members) {
    evidence += own_ratio(node);
    off_line += !own_[node].on_line;
  }
  const bool strays = 2 * off_line > island.size;
  const double needed = std::log(static_cast<double>(frame.nodes.size())) + cost_of_rim(frame, island) +
                        std::log(static_cast<double>(island.size) / options_.wrong_cells_max);
  island.rule = DecodeRule::kWeakIsland;
  if (options_.rules.apply(DecodeRule::kWeakIsland, evidence < needed)) return;
  // Every other place where the epipolar line of one of its nodes lets it be, or anywhere for an island that strays.
  const std::int32_t probe = members[members.size() / 2];
  double places = 0, likelihood_elsewhere = 0;
  frame.gate.visit(probe, strays, [&](int row, int column) {
    ++places;
    const int down = row - frame.claims[probe].row, right = column - frame.claims[probe].column;
    if ((down == 0 && right == 0) || !compares) return;
    double there = 0;
    for (const std::int32_t node : members) {
      const int at_row = frame.claims[node].row + down, at_column = frame.claims[node].column + right;
      there += shown(at_row, at_column) ? ratio(frame, node, at_row, at_column) : -log_letters_;
      if (there < evidence - 60) break;
    }
    likelihood_elsewhere += std::exp(there - evidence);
  });
  if (options_.rules.apply(DecodeRule::kWeakIsland, evidence < needed + std::log(std::max(1., places)))) return;
  const bool fits_elsewhere = likelihood_elsewhere * static_cast<double>(island.size) > options_.wrong_cells_max;
  if (options_.rules.apply(DecodeRule::kIslandElsewhere, fits_elsewhere)) {
    island.rule = DecodeRule::kIslandElsewhere;
  } else {
    island.rule =
        options_.rules.apply(DecodeRule::kIslandOffLine, strays) ? DecodeRule::kIslandOffLine : DecodeRule::kWindows;
  }
}

/// One place of the projector lights one place of the scene. Two islands that both show the same part of the pattern,
/// as much of it as makes an island, cannot both be it, and nothing says which is.
void IslandJudge::refuse_doubles(const Frame& frame) {
  if (islands_.size() < 2) return;
  holder_.assign(static_cast<std::size_t>(options_.rows) * options_.columns, -1);
  for (const Island& island : islands_) {
    if (!island.stands()) continue;
    const auto members = std::span(members_).subspan(island.first, island.size);
    for (const std::int32_t node : members) {
      std::int32_t& holder =
          holder_[static_cast<std::size_t>(frame.claims[node].row) * options_.columns + frame.claims[node].column];
      if (holder < 0) holder = node;
    }
  }
  const double needed = std::log(static_cast<double>(frame.nodes.size()) / options_.wrong_cells_max);
  std::vector<std::pair<std::int32_t, double>> shared;  // with which island, and how much evidence
  for (std::size_t id = 0; id < islands_.size(); ++id) {
    Island& island = islands_[id];
    if (!island.stands() && island.rule != DecodeRule::kIslandTwice) continue;
    shared.clear();
    for (std::int32_t i = island.first; i < island.first + island.size; ++i) {
      const std::int32_t node = members_[i];
      const std::int32_t holder =
          holder_[static_cast<std::size_t>(frame.claims[node].row) * options_.columns + frame.claims[node].column];
      if (holder < 0 || island_of_[holder] == static_cast<std::int32_t>(id)) continue;
      const auto known = std::ranges::find(shared, island_of_[holder], &std::pair<std::int32_t, double>::first);
      (known == shared.end() ? shared.emplace_back(island_of_[holder], 0.) : *known).second += own_ratio(node);
    }
    for (const auto& [other, evidence] : shared) {
      if (options_.rules.apply(DecodeRule::kIslandTwice, evidence >= needed))
        island.rule = islands_[other].rule = DecodeRule::kIslandTwice;
    }
  }
}

/// Without those that were no islands: what is left of a contradiction is an edge, or stands alone.
void IslandJudge::drop_rejected(const Frame& frame) {
  queue_.clear();
  std::size_t islands = 0;
  std::int32_t kept = 0;
  for (const Island& island : islands_) {
    const auto members = std::span(members_).subspan(island.first, island.size);
    if (!island.stands()) {
      for (const std::int32_t node : members) island_of_[node] = -1;
      queue_.insert(queue_.end(), members.begin(), members.end());
      continue;
    }
    for (const std::int32_t node : members) island_of_[node] = static_cast<std::int32_t>(islands);
    std::ranges::copy(members, members_.begin() + kept);
    islands_[islands++] = {.first = kept, .size = island.size};
    kept += island.size;
  }
  islands_.resize(islands);
  members_.resize(static_cast<std::size_t>(kept));
  read_links_around(frame, queue_);
}

/// Without the nodes that were cut. What they have parted has to stand by itself.
void IslandJudge::part_islands(const Frame& frame, Executor& executor) {
  queue_.clear();
  for (const std::int32_t node : members_) {
    if (cut_[node] == 0) continue;
    const bool is_misread = options_.rules.apply(DecodeRule::kOtherLetter, own_ratio(node) < 0);
    frame.claims[node].decide(is_misread ? DecodeRule::kOtherLetter : cut_by_[node]);
    queue_.push_back(node);
    --islands_[island_of_[node]].size;
  }
  if (queue_.empty()) return;
  const auto left = std::ranges::count_if(islands_, [](const Island& island) { return island.size > 0; });
  find_islands(frame);
  if (static_cast<std::ptrdiff_t>(islands_.size()) == left) {
    read_links_around(frame, queue_);
  } else {
    read_links(frame, executor);
  }
  for (Island& island : islands_) weigh(frame, island);
}

void IslandJudge::judge(const std::vector<GridNode>& nodes, const std::vector<Beside>& beside,
                        const std::vector<Classification>& shapes, const CellGate& gate, Executor& executor,
                        std::vector<CellClaim>& claims) {
  const Frame frame{nodes, beside, shapes, gate, claims};
  if (options_.rules.has(DecodeRule::kGrown)) grow(frame);
  own_.resize(nodes.size());
  executor.run_ranges(nodes.size(),
                      [&](std::size_t first, std::size_t last, int) { look_at_own_cells(frame, first, last); });
  find_islands(frame);
  read_links(frame, executor);
  for (Island& island : islands_) weigh(frame, island);
  const auto take_over = [&] {
    for (const std::int32_t node : members_) {
      const Island& island = islands_[island_of_[node]];
      claims[node].island = island_of_[node];
      if (island.stands()) continue;
      claims[node].decide(island.rule);
      if (island.rule == DecodeRule::kWeakIsland || island.rule == DecodeRule::kIslandElsewhere)
        claims[node].row = claims[node].column = -1;
    }
  };
  take_over();
  drop_rejected(frame);
  cut_rims(frame);
  part_islands(frame, executor);
  refuse_doubles(frame);
  take_over();
  for (const std::int32_t node : members_) {
    CellClaim& claim = claims[node];
    if (claim.status != RegionStatus::kDecoded) continue;
    const auto refuse = [&](DecodeRule rule, bool holds) {
      const bool applies = options_.rules.apply(rule, holds);
      if (applies) claim.decide(rule);
      return applies;
    };
    refuse(DecodeRule::kNoLetter, shapes[node].letter < 0) || refuse(DecodeRule::kOtherLetter, own_ratio(node) < 0) ||
        refuse(DecodeRule::kCellOffLine, !own_[node].on_line) ||
        refuse(DecodeRule::kCellOutOfRange, !own_[node].admitted);
  }
}

}  // namespace slsd
