// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/islands.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/symbols/classify.hpp"

namespace slsd {

/// Names the cell of each node.
///
/// 1. Every full 3x3 window is looked up: exactly wherever it lies, and with as many errors as the array's distance
///    corrects on its epipolar line.
/// 2. Each window found votes for the cells of all its nine nodes, so a node at an edge, or misread, is named by its
///    neighbours; what the gate excludes for that node is no vote.
/// 3. What is thus proposed is judged as islands: see IslandJudge.
/// @thread thread-bound: keeps its buffers
class WindowDecoder {
 public:
  /// @param codebook         of the part of the pattern's array that is shown
  /// @param wrong_cells_max  see IslandOptions
  WindowDecoder(const Pattern& pattern, std::shared_ptr<const Codebook> codebook, double wrong_cells_max,
                Rules rules = {});

  void decode(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes, const CellGate& gate,
              Executor& executor, std::vector<CellClaim>& claims);

 private:
  /// The cell of a window's middle, where the window was found.
  struct Hit {
    std::int16_t row = -1, column = -1;
    int weight = 0;
    bool strays = false;  // it lies where the gate does not admit its middle
  };
  struct Vote {
    int row, column;
    int weight;
  };
  static constexpr int kVotes = 4;
  struct Ballot {
    std::array<Vote, kVotes> votes;
    int count = 0;
  };

  void look_up_windows(std::int32_t first, std::int32_t last, const CellGate& gate);
  [[nodiscard]] std::uint32_t key_of(const Neighbourhood& around) const;
  [[nodiscard]] Hit continued(std::int32_t node, std::uint32_t key, std::int32_t first) const;
  [[nodiscard]] Hit look_up(std::int32_t node, std::uint32_t key, const CellGate& gate) const;
  [[nodiscard]] Ballot collect_votes(std::int32_t node, const CellGate& gate) const;
  void vote(std::int32_t node, const Vote& vote, bool strays, const CellGate& gate, Ballot& ballot) const;
  void elect(std::int32_t node, const CellGate& gate, CellClaim& claim) const;
  [[nodiscard]] bool is_unanimous(std::int32_t node) const;
  void weigh_rivals(const std::vector<Classification>& shapes, std::vector<CellClaim>& claims);
  [[nodiscard]] bool shown(int row, int column) const {
    return row >= 0 && column >= 0 && row < codebook_->rows() && column < codebook_->columns();
  }

  CodeArray array_;
  std::shared_ptr<const Codebook> codebook_;  // shared by all decoders of the pattern: it never changes
  bool unique_, corrects_;                    // no two windows alike; none alike but for two letters
  float log_letters_;
  std::vector<Beside> beside_;
  std::vector<std::int8_t> letters_;  // of each node, from the second on; the first is that of no node
  std::vector<Neighbourhood> around_;
  std::vector<Hit> hits_;
  std::vector<std::uint8_t> claimed_;  // of each cell: whether once, or more often
  Rules rules_;
  IslandJudge judge_;
};

}  // namespace slsd
