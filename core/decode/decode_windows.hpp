// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/cell_gate.hpp"
#include "core/decode/classify.hpp"
#include "core/decode/decoding.hpp"
#include "core/decode/neighbourhood.hpp"

namespace slsd {

/// A cell of the pattern that a node was found to be, and how well its surroundings speak for it.
struct CellClaim {
  std::int16_t row = -1, column = -1;
  float evidence = 0;  ///< log-likelihood of the window's shapes at this cell against chance, natural logarithm
  RegionStatus status = RegionStatus::kNoNeighbour;  ///< kDecoded, or why not

  [[nodiscard]] bool named() const { return row >= 0; }
  [[nodiscard]] bool same_cell(int other_row, int other_column) const {
    return row == other_row && column == other_column;
  }
};

struct DecodeWindowsOptions {
  int rows = 0, columns = 0;    ///< of the part of the array that is shown
  float evidence_min = 5;       ///< e^5: odds of 150 to 1 against chance
  float own_class_min = -2.5F;  ///< log-probability of the node's own letter at its cell
  float mismatch = -3;          ///< what one neighbour may count against a cell at the most
  /// Named neighbours that contradict a cell, for one that agrees, at which it is rejected: beside an edge in depth a
  /// symbol of the one surface can fit the grid of the other, and be of the right letter by chance.
  float dissent_max = 0.2F;
};

/// Names the cell of each node.
///
/// 1. Every full 3x3 window is looked up, correcting as many errors as the array's distance allows; what the epipolar
/// gate
///    excludes does not count.
/// 2. Each window found votes for the cells of all its nine nodes, so a node at an edge, or misread, is named by its
/// neighbours; what the gate excludes for that node is no vote.
/// 3. What no window reaches is named by neighbours that are named already.
/// 4. Every name is verified: the node's own shape, and the shapes around it, have to be those of the cells around that
/// cell.
/// @thread thread-bound: keeps its buffers
class WindowDecoder {
 public:
  WindowDecoder(const Pattern& pattern, DecodeWindowsOptions options, int radius);

  void decode(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes, const CellGate& gate,
              std::vector<CellClaim>& claims);

 private:
  /// The cell of a window's middle, where the window was found.
  struct Hit {
    std::int16_t row = -1, column = -1;
    int weight = 0;
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

  void look_up_windows(const std::vector<Classification>& shapes, const CellGate& gate);
  [[nodiscard]] std::optional<std::uint32_t> key_of(const Neighbourhood& around,
                                                    const std::vector<Classification>& shapes) const;
  [[nodiscard]] Hit continued(std::int32_t node, std::uint32_t key) const;
  [[nodiscard]] Hit look_up(std::int32_t node, std::uint32_t key, const CellGate& gate) const;
  [[nodiscard]] Ballot collect_votes(std::int32_t node, const CellGate& gate) const;
  void vote(std::int32_t node, const Vote& vote, const CellGate& gate, Ballot& ballot) const;
  void elect(const CellGate& gate, std::vector<CellClaim>& claims) const;
  void spread(const std::vector<GridNode>& nodes, const CellGate& gate, std::vector<CellClaim>& claims);
  void verify(const std::vector<Classification>& shapes, std::vector<CellClaim>& claims) const;
  [[nodiscard]] float shape_evidence(const Classification& shape, int row, int column) const {
    if (shape.letter < 0) return 0;
    return std::max(shape.log_probability[array_.at(row, column)] + log_letters_, options_.mismatch);
  }
  [[nodiscard]] bool shown(int row, int column) const {
    return row >= 0 && column >= 0 && row < options_.rows && column < options_.columns;
  }

  struct Codebooks {
    Codebook exact, correcting;  // the first is small enough to stay in the cache
  };

  CodeArray array_;
  DecodeWindowsOptions options_;
  std::shared_ptr<const Codebooks> codebooks_;  // shared with copies: the larger part of a decoder, and never changes
  bool unique_;                                 // no two windows alike
  float log_letters_;
  std::vector<Neighbourhood> around_;
  std::vector<Hit> hits_;
};

}  // namespace slsd
