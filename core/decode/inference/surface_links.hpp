// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/link_grid.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/inference/letter_evidence.hpp"
#include "core/decode/symbols/grey_moments.hpp"
#include "core/executor.hpp"

namespace slsd {

/// Properties of a frame's nodes while no cell is certain yet, one entry for each node.
struct NodesSeen {
  std::span<const GridNode> nodes;
  std::span<const Beside> beside;
  std::span<const GreyMoments> moments;
  std::span<const Aligned> aligned;
  std::span<const std::int32_t> labels;  ///< cells, -1: none
};

/// The nats by which each link supports one surface on both its sides, against an edge in depth across it.
///
/// - Slip: difference between a step along a line and the step behind it, along the epipolar line. On one surface it
///   follows Student's t. Its width comes from what depth cannot cause (the difference across the epipolar line) and
///   from the surface's bend so far. Across an edge the slip is anywhere within the search.
/// - Light: ratio of the brightness of the two symbols, each relative to the mean of its letter. On one surface it
///   follows Student's t, as wide as among this frame's links; across an edge, a broad normal distribution. Light
///   never supports one surface, as two surfaces may be lit alike.
/// @thread thread-bound: keeps its buffers
class SurfaceLinks {
 public:
  explicit SurfaceLinks(float pitch_px) : pitch_px_(pitch_px) {}

  void measure(const NodesSeen& seen, const LetterEvidence& letters, const CellGate& gate, Executor& executor);

  /// Returns a node's links by Direction; 0 for links without evidence.
  [[nodiscard]] const std::array<float, 4>& of(std::size_t node) const { return nats_[node]; }
  /// Difference between the step ahead and the step behind, along the epipolar line, cells; NaN unless both exist.
  [[nodiscard]] float slip(std::size_t node, Direction d) const { return bends_[node][d % 2].x(); }

 private:
  void measure_bends(const NodesSeen& seen, const CellGate& gate, const CellGrid& grid, Executor& executor);
  [[nodiscard]] float usual_slip(const NodesSeen& seen, const LetterEvidence& letters);
  void measure_slips(const NodesSeen& seen, float least, Executor& executor);
  void measure_light(const NodesSeen& seen, const LetterEvidence& letters);
  void add_light(const NodesSeen& seen, const CellGrid& grid, Executor& executor);

  float pitch_px_;
  std::vector<std::array<Eigen::Vector2f, 2>> bends_;  // along rows and columns: components along the epipolar line,
                                                       // and across
  std::vector<std::array<float, 4>> nats_;
  std::vector<float> light_;  // for each node, logarithm, less its letter's mean; NaN if unknown
  std::vector<float> sample_;
};

}  // namespace slsd
