// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "core/decode/cell_rays.hpp"
#include "core/geometry/epipolar_gate.hpp"

namespace slsd {

/// Which cells a node can be: those on its epipolar line, within the working depth. Leaves one in 25 to 200.
/// @thread reentrant
class CellGate {
 public:
  /// @param segments      one to a node; empty admits every cell (the paper has no gate)
  /// @param tolerance_px  distance from the epipolar line, projector px
  CellGate(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px)
      : cells_(cells), segments_(segments), tolerance_px_(tolerance_px) {}

  [[nodiscard]] bool admits(std::int32_t node, int row, int column) const {
    return segments_.empty() || segments_[node].passes(cells_.ray(row, column).direction, tolerance_px_);
  }
  /// Whether the cell lies on the node's epipolar line, at whatever depth.
  [[nodiscard]] bool on_line(std::int32_t node, int row, int column) const {
    return segments_.empty() ||
           std::abs(segments_[node].residual_px(cells_.ray(row, column).direction)) <= tolerance_px_;
  }
  /// Calls visit(row, column) for every cell that a node can be; with `anywhere` for every cell.
  template <class Visit>
  void visit(std::int32_t node, bool anywhere, Visit&& visit) const {
    for (int row = 0; row < cells_.rows(); ++row) {
      for (int column = 0; column < cells_.columns(); ++column)
        if (anywhere || admits(node, row, column)) visit(row, column);
    }
  }

 private:
  const CellRays& cells_;
  std::span<const EpipolarSegment> segments_;
  double tolerance_px_;
};

}  // namespace slsd
