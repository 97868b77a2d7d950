// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/cell_rays.hpp"
#include "core/executor.hpp"
#include "core/geometry/epipolar/epipolar_gate.hpp"

namespace slsd {

/// Turns claims into correspondences. Each cell belongs to at most one node, on its epipolar line and within the
/// working depth. If several nodes claim one cell, nothing tells which is right, so all of them are rejected.
/// @thread thread-bound: keeps its buffers
class Correspondence {
 public:
  explicit Correspondence(Rules rules = {}) : rules_(rules) {}

  /// @param segments      one for each node
  /// @param tolerance_px  distance from the epipolar line, projector px: epipolar_gate_px()
  /// @param claims        in and out: rejected ones change their status
  void correspond(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px,
                  Executor& executor, std::vector<CellClaim>& claims);

  /// Rejects duplicates alone, for use without a calibration.
  void settle_duplicates(const CellRays& cells, std::vector<CellClaim>& claims);

 private:
  Rules rules_;
  std::vector<std::int32_t> claims_of_;  // for each cell
};

}  // namespace slsd
