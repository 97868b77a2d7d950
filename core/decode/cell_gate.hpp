// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

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

 private:
  const CellRays& cells_;
  std::span<const EpipolarSegment> segments_;
  double tolerance_px_;
};

}  // namespace slsd
