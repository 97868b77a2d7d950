// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include "core/decode/decode_windows.hpp"

namespace slsd {

struct CorrespondOptions {
  double epipolar_max_px = 1.5;  ///< projector px
  float evidence_margin = 2;     ///< by how much the better of two claims on one cell has to be better to stand
};

/// Makes correspondences of claims: each cell belongs to one node at most, on its epipolar line and within the working
/// depth. Of two claims on one cell the better stands, if it is clearly better; otherwise neither.
/// @param segments  one to a node
/// @param claims    in and out: rejected ones change their status
/// @thread thread-bound: keeps its buffers
class Correspondence {
 public:
  explicit Correspondence(CorrespondOptions options) : options_(options) {}

  void correspond(const CellRays& cells, std::span<const EpipolarSegment> segments, std::vector<CellClaim>& claims);

  /// The duplicates alone, where there is no calibration.
  void settle_duplicates(const CellRays& cells, std::vector<CellClaim>& claims);

 private:
  CorrespondOptions options_;
  std::vector<std::int32_t> holder_;  // of each cell
};

}  // namespace slsd
