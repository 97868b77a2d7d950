// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "core/decode/grid/decode_windows.hpp"
#include "core/decode/symbols/classify.hpp"

namespace slsd {

struct CorrespondOptions {
  float evidence_margin = 2;  ///< by how much the better of two claims on one cell has to be better to stand
  float pitch_px = 18, symbol_size_px = 16;  ///< of the pattern, projector px
  int rows = 44, columns = 71;               ///< of it that are shown whole
  Rules rules = {};
};

/// Makes correspondences of claims: each cell belongs to one node at most, on its epipolar line and within the working
/// depth. Of two claims on one cell the better stands, if it is clearly better; otherwise neither.
/// @param segments      one to a node
/// @param tolerance_px  distance from the epipolar line, projector px: epipolar_gate_px()
/// @param claims        in and out: rejected ones change their status
/// @thread thread-bound: keeps its buffers
class Correspondence {
 public:
  explicit Correspondence(CorrespondOptions options) : options_(options) {}

  void correspond(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px,
                  Executor& executor, std::vector<CellClaim>& claims);

  /// Refuses what an edge may have torn: symbols at a rim most of whose neighbours, seen from the row within, were
  /// refused, and those on a line of which more are torn than whole, as what is left of two symbols can look like one.
  /// Not those that fit their island's grid tightly: no edge runs there. Then corners and rests of something else that
  /// agree by chance.
  /// @param shapes    one to a node, as its claim
  /// @param frame_px  width and height: symbols that the frame's border cuts are not read, and may be anything
  void refuse_lone(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes,
                   const Eigen::Vector2f& frame_px, Executor& executor, std::vector<CellClaim>& claims);

  /// The duplicates alone, where there is no calibration.
  void settle_duplicates(const CellRays& cells, std::vector<CellClaim>& claims);

 private:
  CorrespondOptions options_;
  std::vector<std::int32_t> holder_;          // of each cell
  std::vector<std::int32_t> rim_, next_rim_;  // nodes beside which the pattern does not go on
  std::vector<std::uint8_t> at_rim_;          // of each node
  std::vector<DecodeRule> refused_;           // of rim_, in one round; kWindows: it stays
};

}  // namespace slsd
