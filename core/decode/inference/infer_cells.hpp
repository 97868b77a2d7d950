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
#include "core/decode/inference/other_light.hpp"
#include "core/decode/inference/propose_cells.hpp"
#include "core/decode/inference/surface_links.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Finds the cells of a frame's nodes, and accepts those that are certain.
///
/// The margin of a node is the number of nats by which the proposed cells are likelier than the likeliest others in
/// which this node's is wrong. The others differ in a set of nodes that an edge in depth would part from the rest, so
/// the margin is a least cut: each letter gives its evidence once, each link holds what it is trusted, and a straight
/// edge counts once. What contradicts draws first. A node is accepted if its margin reaches a threshold.
/// @thread thread-bound: keeps its buffers
class CellInference {
 public:
  /// @param codebook  of the part of the pattern's array that is shown
  CellInference(const Pattern& pattern, std::shared_ptr<const Codebook> codebook);

  /// @param margin_min  nats that a symbol needs with a calibration; without one, in which every cell is possible, it
  ///                    needs as many more as there are more cells
  /// @param light       tells print from edges in torn symbols
  /// @param seen        in: nodes, shapes and moments; out: claims, whose evidence is the margin up to that threshold
  void infer(const CellGate& gate, float margin_min, const OtherLight& light, Executor& executor, Sightings& seen);

 private:
  [[nodiscard]] NodesSeen view_of(const Sightings& seen) const;
  void find_printed(const Sightings& seen, const OtherLight& light);
  void drop_misread();
  void set_capacities();
  [[nodiscard]] float rival_nats(std::size_t node, Direction d) const;
  void lower_beside_edges();
  void join_lines();
  void fill_flow();
  void draw_contradictions();
  [[nodiscard]] EvidenceFlow::Budget budget_of(std::size_t node) const;
  void measure_margins();
  void find_islands();
  [[nodiscard]] DecodeRule decide(const CellGate& gate, const Classification& shape, std::size_t node) const;
  void claim_cells(const CellGate& gate, Sightings& seen) const;
  [[nodiscard]] GridFit grid_fit(std::size_t node) const;

  CellGrid grid_;
  CellProposer proposer_;
  LetterEvidence letters_;
  SurfaceLinks links_;
  EdgePrior prior_;
  EvidenceFlow flow_;
  float pitch_px_, margin_max_ = 0;
  std::vector<Beside> beside_;
  std::vector<std::int32_t> proposed_, labels_;  // cells; labels without the misread ones
  std::vector<std::uint8_t> printed_;
  std::vector<float> rivals_;          // of each node: the nats of another cell that a neighbour names
  std::vector<float> nats_, margins_;  // of each node: of its own letter, and of its cell
  std::vector<std::array<float, 4>> capacity_, against_;  // of each link, at the start
  std::vector<float> line_capacity_;
  std::vector<std::int32_t> island_, queue_;
};

}  // namespace slsd
