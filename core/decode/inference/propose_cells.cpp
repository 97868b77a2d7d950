// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/propose_cells.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr std::uint8_t kNoLetter = kMaxLetters;
/// A window is certain if this many of its nine letters agree and give this much of their possible evidence.
constexpr int kCertainLetters = 6;
constexpr float kCertainShare = 0.85F;
/// Evidence for the cell adjacent to that of a certain neighbour, against some forty candidate cells on an epipolar
/// line, nats.
constexpr float kBesideCertain = 3.7F;
/// Distance from its line that a damaged shape may have, of the pitch of the cells.
constexpr double kOffLineShare = 0.2;

}  // namespace

CellProposer::CellProposer(const CodeArray& array, std::shared_ptr<const Codebook> codebook)
    : grid_{codebook->rows(), codebook->columns()},
      codebook_(std::move(codebook)),
      unique_(array.minimum_distance > 0),
      log_letters_(std::log(static_cast<float>(array.letters))),
      stride_(grid_.columns + 2) {
  letters_.assign(static_cast<std::size_t>(stride_) * (grid_.rows + 2), kNoLetter);
  for (int row = 0; row < grid_.rows; ++row)
    for (int column = 0; column < grid_.columns; ++column)
      letters_[static_cast<std::size_t>(row + 1) * stride_ + column + 1] =
          static_cast<std::uint8_t>(array.at(row, column));
}

CellProposer::WindowEvidence CellProposer::evidence_around(std::int32_t node) const {
  WindowEvidence window;
  const Neighbourhood& around = around_[static_cast<std::size_t>(node)];
  for (int i = 0; i < kWindowCells; ++i) window[i] = nats_[static_cast<std::size_t>(around[i] + 1)].data();
  return window;
}

float CellProposer::window_nats(const WindowEvidence& window, std::int32_t cell) const {
  const std::uint8_t* const middle =
      letters_.data() + (grid_.row_of(cell) + 1) * static_cast<std::ptrdiff_t>(stride_) + grid_.column_of(cell) + 1;
  float nats = 0;
  for (int i = 0; i < kWindowCells; ++i)
    nats += window[i][middle[(i / kWindowSide - 1) * stride_ + i % kWindowSide - 1]];
  return nats;
}

CellProposer::Proposal CellProposer::weigh(std::int32_t node, std::int32_t cell) const {
  const auto there =
      std::ranges::count_if(around_[static_cast<std::size_t>(node)], [](std::int32_t other) { return other >= 0; });
  const float nats = window_nats(evidence_around(node), cell);
  return {cell, nats, there >= kCertainLetters && nats >= kCertainShare * log_letters_ * static_cast<float>(there)};
}

/// Proposes the cell adjacent to the certain cell of a neighbour, with few alternatives to compare.
/// @param first  first node of the range that is under way: the nodes before it may change meanwhile
CellProposer::Proposal CellProposer::continued(const Frame& frame, std::int32_t node, std::int32_t first) const {
  for (const Direction d : {kLeft, kUp}) {
    const std::int32_t other = frame.beside[static_cast<std::size_t>(node)][d];
    if (other < first || other >= node || !proposals_[static_cast<std::size_t>(other)].certain) continue;
    const std::int32_t cell = grid_.beyond(proposals_[static_cast<std::size_t>(other)].cell, opposite(d));
    if (cell < 0 || !frame.gate.admits(node, grid_.row_of(cell), grid_.column_of(cell))) continue;
    if (const Proposal proposal = weigh(node, cell); proposal.certain) return proposal;
  }
  return {};
}

/// Additional distance from its line that a node may have.
double CellProposer::off_line_px(const Frame& frame, std::int32_t node) {
  return frame.shapes[static_cast<std::size_t>(node)].is_well_seen() ? 0 : kOffLineShare * frame.gate.pitch_px();
}

CellProposer::Proposal CellProposer::best_on_line(const Frame& frame, std::int32_t node) const {
  std::int32_t best = -1;
  float most = 0;
  const WindowEvidence window = evidence_around(node);
  frame.gate.visit_along(node, off_line_px(frame, node), [&](int row, int column) {
    const std::int32_t cell = grid_.at(row, column);
    if (const float nats = window_nats(window, cell); nats > most) best = cell, most = nats;
  });
  return best < 0 ? Proposal{} : weigh(node, best);
}

/// Looks up the cell of a completely read window anywhere in the pattern: without a calibration, or for light that does
/// not follow the calibration.
CellProposer::Proposal CellProposer::looked_up(const Frame& frame, std::int32_t node) const {
  if (!unique_) return {};
  std::uint32_t key = 0;
  for (const std::int32_t other : around_[static_cast<std::size_t>(node)]) {
    if (other < 0 || frame.shapes[static_cast<std::size_t>(other)].letter < 0) return {};
    key = codebook_->append(key, static_cast<std::uint8_t>(frame.shapes[static_cast<std::size_t>(other)].letter));
  }
  Proposal found;
  codebook_->find(key, [&](const Codebook::Entry& entry) { found = weigh(node, grid_.at(entry.row, entry.column)); });
  return found;
}

void CellProposer::propose_range(const Frame& frame, std::int32_t first, std::int32_t last) {
  for (std::int32_t node = first; node < last; ++node) {
    Proposal& proposal = proposals_[static_cast<std::size_t>(node)] = continued(frame, node, first);
    if (proposal.certain) continue;
    // No cell on the line supports a completely read window more than the one that it looks up, which costs less.
    const Proposal anywhere = looked_up(frame, node);
    const bool is_on_line =
        anywhere.certain &&
        frame.gate.admits(node, grid_.row_of(anywhere.cell), grid_.column_of(anywhere.cell), off_line_px(frame, node));
    if (!is_on_line && frame.gate.knows_lines()) proposal = best_on_line(frame, node);
    if (!proposal.certain && anywhere.certain) proposal = anywhere;
  }
}

/// Offers each node the cells adjacent to those of its neighbours.
void CellProposer::carry_on(const Frame& frame) {
  next_ = proposals_;
  for (std::size_t i = 0; i < proposals_.size(); ++i) {
    if (proposals_[i].certain) continue;
    const auto node = static_cast<std::int32_t>(i);
    const bool is_degraded = !frame.shapes[i].is_well_seen();  // its centroid may be displaced, and break its links
    for (const Direction d : kDirections) {
      const std::int32_t other = is_degraded ? frame.nodes[i].links[d] : frame.beside[i][d];
      if (other < 0) continue;
      const Proposal& from = proposals_[static_cast<std::size_t>(other)];
      const std::int32_t cell = grid_.beyond(from.cell, opposite(d));
      if (cell < 0 || cell == next_[i].cell) continue;
      if (!frame.gate.admits(node, grid_.row_of(cell), grid_.column_of(cell), off_line_px(frame, node))) continue;
      Proposal there = weigh(node, cell);
      if (is_degraded && from.certain) there.nats += kBesideCertain;
      if (next_[i].cell < 0 || there.nats > next_[i].nats) next_[i] = there;
    }
  }
  proposals_.swap(next_);
}

void CellProposer::propose(std::span<const GridNode> nodes, std::span<const Beside> beside,
                           std::span<const Classification> shapes, const CellGate& gate, Executor& executor,
                           std::vector<std::int32_t>& labels) {
  constexpr std::size_t kRange = 768;  // several rows of windows: most continue a window of their range
  constexpr int kCarried = 3;          // number of links
  const Frame frame{nodes, beside, shapes, gate};
  around_.resize(beside.size());
  proposals_.resize(beside.size());
  nats_.assign(1, {});
  for (const Classification& shape : shapes) {
    auto& nats = nats_.emplace_back();
    if (shape.letter < 0) continue;
    for (int letter = 0; letter < kMaxLetters; ++letter) nats[letter] = shape.log_probability[letter] + log_letters_;
  }
  executor.run_ranges(
      beside.size(),
      [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i) around_[i] = neighbourhood(beside, static_cast<std::int32_t>(i));
        propose_range(frame, static_cast<std::int32_t>(first), static_cast<std::int32_t>(last));
      },
      kRange);
  for (int link = 0; link < kCarried; ++link) carry_on(frame);
  labels.clear();
  for (const Proposal& proposal : proposals_) labels.push_back(proposal.cell);
}

}  // namespace slsd
