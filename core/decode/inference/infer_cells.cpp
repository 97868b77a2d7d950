// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/infer_cells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/decode/inference/margin.hpp"

namespace slsd {
namespace {

constexpr float kMisreadNats = -2;  // nats: a shape with less does not lie on the neighbours' surface
constexpr float kGoesOn = 0.5F;     // nats that hold a link beside a cut one: edges continue straight
constexpr float kLineMore = 0.1F;   // nats that each further link of a straight edge costs
constexpr float kSideMore = 2;      // nats that each further cut side costs: edges turn corners and come in pairs
constexpr float kAgainstMax = 9;    // nats
constexpr float kSlipKnown = 1;     // nats: the link beside shows that no edge runs there
constexpr int kSideLinks = 8;       // largest number of links that count for a side
constexpr float kUsualPlaces = 40;  // candidate cells on an epipolar line for which the threshold was measured

bool is_along_row(Direction d) {
  return d == kRight || d == kLeft;
}

}  // namespace

CellInference::CellInference(const Pattern& pattern, const std::shared_ptr<const Codebook>& codebook,
                             double wrong_cells_max, Rules rules)
    : rules_(rules),
      grid_{codebook->rows(), codebook->columns()},
      proposer_(pattern.array, codebook),
      letters_(pattern.array, grid_),
      links_(static_cast<float>(pattern.pitch_px())),
      margin_min_(margin_for(wrong_cells_max)) {}

NodesSeen CellInference::view_of(const Sightings& seen) const {
  return {seen.nodes, beside_, seen.moments, seen.aligned, labels_};
}

void CellInference::drop_misread() {
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    nats_[i] = labels_[i] < 0 ? 0 : letters_.of(static_cast<std::int32_t>(i), labels_[i]);
    if (nats_[i] < kMisreadNats) labels_[i] = -1, nats_[i] = 0;
  }
}

void CellInference::set_capacities() {
  capacity_.assign(labels_.size(), {}), against_.assign(labels_.size(), {}), rivals_.assign(labels_.size(), 0);
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    const bool is_split = labels_[i] < 0 && proposed_[i] >= 0 && !letters_.shapes()[i].is_well_seen();
    if (labels_[i] < 0 && !is_split) continue;
    for (const Direction d : kDirections) {
      const std::int32_t other = beside_[i][d];
      if (other < 0) continue;
      const float slip = links_.of(i)[d];
      const float odds = 0.5F * (prior_.log_odds(i, d) + prior_.log_odds(static_cast<std::size_t>(other), d));
      const float trusted = std::max(0.F, odds + slip);
      const std::int32_t there = grid_.beyond(proposed_[i], d);
      if (there >= 0 && labels_[other] == there) {
        capacity_[i][d] = trusted;
      } else if (!is_split) {  // a split symbol contradicts nothing and supports nothing: its neighbours support it
        const float against = there < 0 ? kAgainstMax : -letters_.of(other, there);
        const float rival = rival_nats(i, d);
        against_[i][d] = std::min(trusted, std::max({0.F, against, rival > 0 ? trusted : 0.F}));
        rivals_[i] = std::max(rivals_[i], rival);
      }
    }
  }
  lower_beside_edges();
}

/// The nats for the cell that a neighbour with a contradicting cell predicts for a node, as if their link held.
float CellInference::rival_nats(std::size_t node, Direction d) const {
  const std::int32_t cell = grid_.beyond(labels_[static_cast<std::size_t>(beside_[node][d])], opposite(d));
  return cell < 0 || cell == labels_[node] ? 0 : std::max(0.F, letters_.of(static_cast<std::int32_t>(node), cell));
}

/// An edge that ends beside a link is likely to continue across it.
void CellInference::lower_beside_edges() {
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    for (const Direction d : kDirections) {
      if (capacity_[i][d] <= 0) continue;
      const std::int32_t other = beside_[i][d];
      for (const int side : {0, 1}) {
        const Direction aside = across(d, side);
        const std::int32_t by_this = beside_[i][aside], by_other = beside_[other][aside];
        const bool goes_on = (by_this >= 0 && prior_.is_cut(static_cast<std::size_t>(by_this), d)) ||
                             (by_other >= 0 && prior_.is_cut(static_cast<std::size_t>(by_other), opposite(d)));
        if (!goes_on) continue;
        const bool is_known = by_this >= 0 && links_.of(static_cast<std::size_t>(by_this))[d] > kSlipKnown;
        const float slip = is_known ? 0.F : std::max(0.F, links_.of(i)[d]);
        capacity_[i][d] = std::min(capacity_[i][d], kGoesOn + slip);
      }
    }
  }
}

/// A straight edge is one event: the parallel links that it crosses share little more than the capacity of one link.
void CellInference::join_lines() {
  line_capacity_.clear();
  for (const Direction d : kDirections) {
    const Direction along = is_along_row(d) ? kDown : kRight;
    for (std::size_t i = 0; i < labels_.size(); ++i) {
      const bool pushes = against_[i][d] > 0;
      const auto& strength = pushes ? against_ : capacity_;
      if (labels_[i] < 0 || strength[i][d] <= 0 || flow_.line_of(i, d) >= 0 || (!pushes && d >= kLeft)) continue;
      const auto next = [&](std::int32_t at, Direction way) {
        const std::int32_t other = capacity_[at][way] > 0 ? beside_[at][way] : -1;
        const bool crosses = other >= 0 && labels_[other] >= 0 && strength[other][d] > 0;
        return crosses && flow_.line_of(static_cast<std::size_t>(other), d) < 0 ? other : -1;
      };
      auto at = static_cast<std::int32_t>(i);
      for (std::int32_t back = next(at, opposite(along)); back >= 0 && back != static_cast<std::int32_t>(i);
           back = next(at, opposite(along)))
        at = back;
      const std::int32_t line = flow_.add_line(0);
      float most = 0, count = 0;
      for (; at >= 0; at = next(at, along)) {
        flow_.put_on_line(static_cast<std::size_t>(at), d, line);
        if (!pushes) flow_.put_on_line(static_cast<std::size_t>(beside_[at][d]), opposite(d), line);
        most = std::max(most, strength[at][d]), count += 1;
      }
      line_capacity_.push_back(most + kLineMore * (count - 1));
      flow_.set_line(line, line_capacity_.back());
    }
  }
}

void CellInference::draw_contradictions() {
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    if (labels_[i] < 0) continue;
    const auto node = static_cast<std::int32_t>(i);
    if (nats_[i] < 0) static_cast<void>(flow_.draw(node, -nats_[i]));
    for (const Direction d : kDirections) {
      if (against_[i][d] <= 0) continue;
      const std::int32_t line = flow_.line_of(i, d);
      const float wanted = line < 0 ? against_[i][d] : std::min(against_[i][d], flow_.line_left(line, d));
      if (wanted <= 0) continue;
      const float drawn = flow_.draw(node, wanted);
      if (line >= 0) flow_.take_from_line(line, d, drawn);
    }
  }
}

/// The first cut side counts in full, each further one little, less what contradictions have used up.
EvidenceFlow::Budget CellInference::budget_of(const EvidenceFlow& flow, std::size_t node) const {
  std::array<float, 4> side{}, drawn{};
  for (const Direction d : kDirections) {
    const float capacity = capacity_[node][d];
    if (capacity <= 0) continue;
    const std::int32_t line = flow.line_of(node, d);
    side[d] = line < 0 ? capacity : std::min(line_capacity_[line], capacity + kLineMore * kSideLinks);
    drawn[d] = std::max(0.F, capacity - flow.capacity_left(node, d));
  }
  const auto together = [&](std::initializer_list<Direction> sides) {
    float most = 0, more = 0, gone = 0;
    for (const Direction d : sides) {
      most = std::max(most, side[d]), more += std::min(side[d], kSideMore), gone += drawn[d];
    }
    return std::max(0.F, most + more - std::min(most, kSideMore) - gone);
  };
  return {together({kRight, kDown, kLeft, kUp}), together({kRight, kLeft}), together({kDown, kUp})};
}

EvidenceFlow& CellInference::flow_of(int worker) {
  return worker == 0 ? flow_ : helpers_[static_cast<std::size_t>(worker) - 1];
}

/// Restores the flow after each node, so the order of nodes and workers decides nothing.
void CellInference::measure_margins(Executor& executor) {
  flow_.keep();
  helpers_.resize(static_cast<std::size_t>(executor.workers()) - 1);
  for (EvidenceFlow& helper : helpers_) helper = flow_;
  for (int worker = 0; worker < executor.workers(); ++worker) flow_of(worker).reserve();
  margins_.assign(labels_.size(), 0);
  const float margin_max = rules_.whole_margins() ? margin_needed_ - margin_min_ + kMarginMax : margin_needed_;
  executor.run_ranges(labels_.size(), [&](std::size_t first, std::size_t last, int worker) {
    EvidenceFlow& flow = flow_of(worker);
    for (std::size_t i = first; i < last; ++i) {
      if (proposed_[i] < 0) continue;
      margins_[i] = flow.draw(static_cast<std::int32_t>(i), margin_max, budget_of(flow, i));
      flow.restore();
    }
  });
}

/// Fit of a node at a boundary. Another surface fits tightly in one of sixty cases at most.
GridFit CellInference::grid_fit(std::size_t node) const {
  float most = 0;
  int supported_by = 0, sides = 0;
  for (const Direction d : kDirections) {
    if (capacity_[node][d] <= 0) continue;
    ++sides;
    const std::int32_t other = beside_[node][d];
    const float slip = links_.slip(static_cast<std::size_t>(other), d);
    if (!std::isnan(slip)) most = std::max(most, std::abs(slip)), ++supported_by;
  }
  constexpr int kAllSides = 4, kTightLinks = 2;
  if (sides == kAllSides) return GridFit::kTight;
  if (supported_by == 0 || most > kOffGridSlip) return GridFit::kNone;
  return supported_by >= kTightLinks && most <= kTightSlip ? GridFit::kTight : GridFit::kLoose;
}

/// Names the rule that accepts or rejects a node with a proposed cell.
DecodeRule CellInference::rule_of(const CellGate& gate, const Sightings& seen, std::size_t node) const {
  const int row = grid_.row_of(proposed_[node]), column = grid_.column_of(proposed_[node]);
  const Classification& shape = seen.shapes[node];
  const bool speaks = labels_[node] >= 0 && nats_[node] > 0;
  if (shape.letter < 0) return DecodeRule::kNoLetter;
  if (!speaks && shape.is_well_seen()) return DecodeRule::kOtherLetter;
  if (margins_[node] < margin_needed_) return DecodeRule::kUncertain;
  if (!speaks && !is_aligned(seen.aligned[node])) return DecodeRule::kSplit;
  if (!gate.on_line(gate.residual_px(static_cast<std::int32_t>(node), row, column))) return DecodeRule::kCellOffLine;
  if (!gate.admits(static_cast<std::int32_t>(node), row, column)) return DecodeRule::kCellOutOfRange;
  return is_aligned(seen.aligned[node]) ? DecodeRule::kRecovered : DecodeRule::kCertain;
}

void CellInference::claim_cells(const CellGate& gate, Sightings& seen) const {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (proposed_[i] < 0) continue;
    CellClaim& claim = seen.claims[i];
    claim.margin_nats = margins_[i];
    claim.grid_fit = grid_fit(i);
    claim.decide(rule_of(gate, seen, i));
  }
}

void CellInference::find_component(std::int32_t first) {
  component_.assign(1, first);
  is_reached_[static_cast<std::size_t>(first)] = 1;
  for (std::size_t next = 0; next < component_.size(); ++next) {
    const std::int32_t node = component_[next];
    for (const Direction d : kDirections) {
      const std::int32_t other = beside_[node][d];
      if (other < 0 || is_reached_[other] != 0 || proposed_[other] < 0) continue;
      if (proposed_[other] != grid_.beyond(proposed_[node], d)) continue;
      is_reached_[other] = 1;
      component_.push_back(other);
    }
  }
}

/// Rejects all symbols of a surface if most of its certain ones lie off their epipolar lines. Then the rig has moved,
/// or another projector lights them. The symbols that lie on their lines do so by chance, and are no points either.
void CellInference::reject_off_line(Sightings& seen) {
  is_reached_.assign(proposed_.size(), 0);
  for (std::size_t first = 0; first < proposed_.size(); ++first) {
    if (proposed_[first] < 0 || is_reached_[first] != 0) continue;
    find_component(static_cast<std::int32_t>(first));
    const auto count = [&](RegionStatus status) {
      return std::ranges::count_if(component_, [&](std::int32_t node) { return seen.claims[node].status == status; });
    };
    if (count(RegionStatus::kOffEpipolarLine) <= count(RegionStatus::kDecoded)) continue;
    for (const std::int32_t node : component_)
      if (seen.claims[node].status == RegionStatus::kDecoded) seen.claims[node].decide(DecodeRule::kCellOffLine);
  }
}

void CellInference::fill_flow() {
  flow_.clear(beside_);
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    flow_.set_supply(i, std::max(0.F, nats_[i] - rivals_[i]));
    for (const Direction d : kDirections) flow_.set_capacity(i, d, capacity_[i][d]);
  }
  join_lines();
}

void CellInference::propose(const CellGate& gate, Executor& executor, Sightings& seen) {
  find_beside(seen.nodes, beside_);
  proposer_.propose(seen.nodes, beside_, seen.shapes, gate, executor, proposed_);
  seen.claims.assign(seen.size(), {});
  seen.aligned.assign(seen.size(), Aligned::kNot);
  seen.misfits.assign(seen.size(), std::numeric_limits<float>::infinity());
  letters_.look_at(seen.shapes, seen.aligned);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CellClaim& claim = seen.claims[i];
    if (proposed_[i] < 0) {
      const bool is_linked = std::ranges::any_of(beside_[i], [](std::int32_t other) { return other >= 0; });
      claim.decide(is_linked ? DecodeRule::kNoWindow : DecodeRule::kNoNeighbour);
      continue;
    }
    claim.row = static_cast<std::int16_t>(grid_.row_of(proposed_[i]));
    claim.column = static_cast<std::int16_t>(grid_.column_of(proposed_[i]));
    const bool speaks = letters_.of(static_cast<std::int32_t>(i), proposed_[i]) > 0;
    const bool is_well_seen = seen.shapes[i].is_well_seen();
    if (speaks) seen.misfits[i] = seen.shapes[i].distance;
    claim.decide(!is_well_seen ? DecodeRule::kSplit : speaks ? DecodeRule::kCertain : DecodeRule::kOtherLetter);
  }
}

void CellInference::decide(const CellGate& gate, Executor& executor, Sightings& seen) {
  const float cells = static_cast<float>(grid_.rows) * static_cast<float>(grid_.columns);
  margin_needed_ = margin_min_ + (gate.knows_lines() ? 0 : std::log(std::max(1.F, cells / kUsualPlaces)));
  find_beside(seen.nodes, beside_);  // recovered symbols have new links
  labels_ = proposed_;
  nats_.resize(labels_.size());
  letters_.look_at(seen.shapes, seen.aligned);
  links_.measure(view_of(seen), letters_, gate, executor);
  letters_.measure_split(beside_, labels_);
  drop_misread();
  prior_.measure(view_of(seen), letters_, executor);
  set_capacities();
  fill_flow();
  draw_contradictions();
  measure_margins(executor);
  claim_cells(gate, seen);
  if (gate.knows_lines()) reject_off_line(seen);
}

}  // namespace slsd
