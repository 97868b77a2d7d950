// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/inference/edge_prior.hpp"
#include "core/decode/inference/evidence_flow.hpp"
#include "core/decode/inference/letter_evidence.hpp"
#include "core/decode/inference/propose_cells.hpp"
#include "core/decode/inference/surface_links.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Finds the cells of a frame's nodes, and accepts those that are certain.
///
/// The margin of a node is a number of nats: how much likelier the proposed cells are than the best alternative in
/// which this node's cell is wrong. The alternatives differ in a set of nodes that an edge in depth would separate from
/// the rest. So the margin is a minimum cut: each letter gives its evidence once, each link has a capacity, and a
/// straight edge counts once. Contradictions draw first. A node is accepted if its margin reaches a threshold.
/// @thread thread-bound: keeps its buffers
class CellInference {
 public:
  /// @param codebook         codebook of the visible part of the pattern's array
  /// @param wrong_cells_max  wrong cells that a frame may have: sets the required margin
  CellInference(const Pattern& pattern, const std::shared_ptr<const Codebook>& codebook, double wrong_cells_max,
                Rules rules = {});

  /// Proposes cells for the nodes, without deciding on any.
  /// @param seen  in: nodes and shapes; out: claims; those whose symbols show their letters well count as decoded for
  ///              now
  void propose(const CellGate& gate, Executor& executor, Sightings& seen);
  /// Decides on the proposed cells.
  /// @param seen  in: nodes, shapes, moments and alignments; out: claims, with their margins up to the threshold
  void decide(const CellGate& gate, Executor& executor, Sightings& seen);

 private:
  [[nodiscard]] NodesSeen view_of(const Sightings& seen) const;
  void drop_misread();
  void set_capacities();
  [[nodiscard]] float rival_nats(std::size_t node, Direction d) const;
  void lower_beside_edges();
  void join_lines();
  void fill_flow();
  void draw_contradictions();
  [[nodiscard]] EvidenceFlow::Budget budget_of(const EvidenceFlow& flow, std::size_t node) const;
  [[nodiscard]] EvidenceFlow& flow_of(int worker);
  void measure_margins(Executor& executor);
  [[nodiscard]] DecodeRule rule_of(const CellGate& gate, const Sightings& seen, std::size_t node) const;
  void claim_cells(const CellGate& gate, Sightings& seen) const;
  void find_component(std::int32_t first);
  void reject_off_line(Sightings& seen);
  [[nodiscard]] GridFit grid_fit(std::size_t node) const;

  Rules rules_;
  CellGrid grid_;
  CellProposer proposer_;
  LetterEvidence letters_;
  SurfaceLinks links_;
  EdgePrior prior_;
  EvidenceFlow flow_;
  std::vector<EvidenceFlow> helpers_;  // copies of the flow, one for each further worker
  float margin_min_, margin_needed_ = 0;
  std::vector<Beside> beside_;
  std::vector<std::int32_t> proposed_, labels_;  // cells; labels without the misread ones
  std::vector<float> rivals_;                    // for each node: the nats of a contradicting cell that a neighbour
                                                 // predicts
  std::vector<float> nats_, margins_;            // for each node: the nats of its own letter, and of its cell
  std::vector<std::array<float, 4>> capacity_, against_;  // for each link, at the start
  std::vector<float> line_capacity_;
  std::vector<std::int32_t> component_;   // nodes whose links lead from cell to cell
  std::vector<std::uint8_t> is_reached_;  // for each node
};

}  // namespace slsd
