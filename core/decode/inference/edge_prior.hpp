// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/link_grid.hpp"
#include "core/decode/inference/letter_evidence.hpp"
#include "core/decode/inference/surface_links.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Prior probability of an edge in depth across a link. It follows from how often links nearby are broken or lead to a
/// different cell, along rows and along columns.
/// @thread thread-bound: keeps its buffers
class EdgePrior {
 public:
  void measure(const NodesSeen& seen, const LetterEvidence& letters, Executor& executor);

  /// Log-odds that no edge crosses a link of the node.
  [[nodiscard]] float log_odds(std::size_t node, Direction d) const { return odds_[node][d % 2]; }
  /// Tells links of link_grid that lead across an edge: they are broken, or their cells contradict each other.
  [[nodiscard]] bool is_cut(std::size_t node, Direction d) const { return cut_[node][d]; }

 private:
  /// Counts of the links around a node, along rows and along columns.
  struct Count {
    std::array<float, 2> links{}, cut{};
  };
  void find_cut(const NodesSeen& seen, const LetterEvidence& letters, Executor& executor);
  void spread(const NodesSeen& seen, Executor& executor);
  [[nodiscard]] static float odds_of(float links, float cut, float usual_share);

  std::vector<std::array<bool, 4>> cut_;
  std::vector<Count> counts_, next_;
  std::vector<std::array<float, 2>> odds_;  // for each node, along rows and along columns
};

}  // namespace slsd
