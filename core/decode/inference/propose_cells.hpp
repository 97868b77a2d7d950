// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/inference/cell_grid.hpp"
#include "core/decode/symbols/classify.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Proposes a cell for each node: the one that the shapes of its 3x3 window support most. Candidates are the cells that
/// the calibration allows, and those adjacent to the cells of its neighbours. It does not judge how certain a proposal
/// is.
/// @thread thread-bound: keeps its buffers
class CellProposer {
 public:
  /// @param codebook  codebook of the visible part of the pattern's array
  CellProposer(const CodeArray& array, std::shared_ptr<const Codebook> codebook);

  /// @param labels  becomes one cell for each node, or -1
  void propose(std::span<const GridNode> nodes, std::span<const Beside> beside, std::span<const Classification> shapes,
               const CellGate& gate, Executor& executor, std::vector<std::int32_t>& labels);

 private:
  struct Frame {
    std::span<const GridNode> nodes;
    std::span<const Beside> beside;
    std::span<const Classification> shapes;
    const CellGate& gate;
  };
  /// A cell, and the nats by which the window supports it.
  struct Proposal {
    std::int32_t cell = -1;
    float nats = 0;
    bool certain = false;  ///< most letters of its window are present and agree
  };
  /// The nats of the letters that each node of a 3x3 window may show.
  using WindowEvidence = std::array<const float*, kWindowCells>;
  [[nodiscard]] WindowEvidence evidence_around(std::int32_t node) const;
  [[nodiscard]] float window_nats(const WindowEvidence& window, std::int32_t cell) const;
  [[nodiscard]] Proposal weigh(std::int32_t node, std::int32_t cell) const;
  [[nodiscard]] Proposal continued(const Frame& frame, std::int32_t node, std::int32_t first) const;
  [[nodiscard]] static double off_line_px(const Frame& frame, std::int32_t node);
  [[nodiscard]] Proposal best_on_line(const Frame& frame, std::int32_t node) const;
  [[nodiscard]] Proposal looked_up(const Frame& frame, std::int32_t node) const;
  void propose_range(const Frame& frame, std::int32_t first, std::int32_t last);
  void carry_on(const Frame& frame);

  CellGrid grid_;
  std::shared_ptr<const Codebook> codebook_;
  bool unique_;
  float log_letters_;
  std::vector<std::uint8_t> letters_;  // for each cell, with a border of kNoLetter
  int stride_;
  std::vector<Neighbourhood> around_;
  std::vector<std::array<float, kMaxLetters + 1>> nats_;  // for each node from the second on, by letter; 0 for no
                                                          // letter
  std::vector<Proposal> proposals_, next_;
};

}  // namespace slsd
