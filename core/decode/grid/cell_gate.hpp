// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/decode/grid/cell_rays.hpp"
#include "core/geometry/epipolar/epipolar_gate.hpp"

namespace slsd {

/// The candidate cells of a node: those on its epipolar line, within the working depth. This leaves one in 25 to 200.
/// @thread reentrant
class CellGate {
 public:
  /// @param segments      one for each node; empty admits every cell (the paper has no gate)
  /// @param tolerance_px  distance from the epipolar line, projector px
  CellGate(const CellRays& cells, std::span<const EpipolarSegment> segments, double tolerance_px)
      : cells_(cells), segments_(segments), tolerance_px_(tolerance_px) {}

  /// @param off_line_px  additional distance from its line that this node may have
  [[nodiscard]] bool admits(std::int32_t node, int row, int column, double off_line_px = 0) const {
    return segments_.empty() || segments_[node].passes(cells_.direction(row, column), tolerance_px_ + off_line_px);
  }
  /// Signed distance of the cell from the node's epipolar line, projector px; 0 without known lines.
  [[nodiscard]] double residual_px(std::int32_t node, int row, int column) const {
    return segments_.empty() ? 0 : segments_[node].residual_px(cells_.direction(row, column));
  }
  [[nodiscard]] double off_line_px(std::int32_t node, int row, int column) const {
    return std::abs(residual_px(node, row, column));
  }
  /// Tells whether a node at this distance lies on its epipolar line, at any depth.
  [[nodiscard]] bool on_line(double residual_px) const { return std::abs(residual_px) <= tolerance_px_; }
  /// Direction of a node's epipolar line past a cell: towards cells to the right and down, of length one. Without known
  /// lines it is the direction of the rows.
  [[nodiscard]] Eigen::Vector2f way_of_line(std::int32_t node, int row, int column) const {
    if (segments_.empty()) return {1, 0};
    const auto off_line = [&](int r, int c) { return segments_[node].residual_px(cells_.direction(r, c)); };
    const int down = row + 1 < cells_.rows() ? 1 : -1, right = column + 1 < cells_.columns() ? 1 : -1;
    const double here = off_line(row, column);
    return Eigen::Vector2d((off_line(row + down, column) - here) * down, (here - off_line(row, column + right)) * right)
        .normalized()
        .cast<float>();
  }
  [[nodiscard]] bool knows_lines() const { return !segments_.empty(); }
  /// Calls visit(row, column) for the candidate cells of a node: one for each column, or for each row, that its
  /// epipolar line crosses within the working depth.
  /// @param off_line_px  additional distance from its line that this node may have
  template <class Visit>
  void visit_along(std::int32_t node, double off_line_px, Visit&& visit) const {
    const EpipolarSegment& segment = segments_[static_cast<std::size_t>(node)];
    if (segment.empty()) return;
    const double tolerance_px = tolerance_px_ + off_line_px;
    const auto off_line = [&](int row, int column) { return segment.residual_px(cells_.direction(row, column)); };
    const int last_row = cells_.rows() - 1, last_column = cells_.columns() - 1;
    const double first = off_line(0, 0);
    const double per_row = (off_line(last_row, 0) - first) / std::max(1, last_row);
    const double per_column = (off_line(0, last_column) - first) / std::max(1, last_column);
    const bool is_steep = std::abs(per_column) > std::abs(per_row);
    const int last_along = is_steep ? last_row : last_column, last_across = is_steep ? last_column : last_row;
    const double per_slope = 1 / (is_steep ? per_column : per_row);
    const double across_per_along = -(is_steep ? per_row : per_column) * per_slope;
    const auto direction = [&](int along, int across) -> const Eigen::Vector2d& {
      return is_steep ? cells_.direction(along, across) : cells_.direction(across, along);
    };
    // From one place to the next, a line at 45 degrees or less moves by 1.5 pitches; a bent one by a little more.
    const double per_step = 1 / (kStepMaxPitches * pitch_px());
    double across = -first * per_slope;
    for (int along = 0; along <= last_along;) {
      // Predict from the previous cell: lens distortion bends the line only gradually. Numbers are rounded by casts.
      const int before = static_cast<int>(std::clamp<double>(across, 0, last_across) + 1.5) - 1;
      across = before - segment.residual_px(direction(along, before)) * per_slope;
      const int nearest = static_cast<int>(std::clamp<double>(across, -1, last_across + 1) + 1.5) - 1;
      const Eigen::Vector2d& there = direction(along, std::clamp(nearest, 0, last_across));
      const int beyond = static_cast<int>(std::min<double>(segment.outside_px(there) * per_step, last_along));
      if (beyond > 0) {
        along += beyond, across += beyond * across_per_along;
        continue;
      }
      if (nearest >= 0 && nearest <= last_across && segment.passes(there, tolerance_px))
        is_steep ? visit(along, nearest) : visit(nearest, along);
      ++along;
    }
  }
  /// Distance between adjacent cells, projector px.
  [[nodiscard]] double pitch_px() const {
    return cells_.rows() > 1 ? (cells_.pixel(1, 0) - cells_.pixel(0, 0)).y() : 0;
  }

 private:
  static constexpr double kStepMaxPitches = 2.5;

  const CellRays& cells_;
  std::span<const EpipolarSegment> segments_;
  double tolerance_px_;
};

}  // namespace slsd
