// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include "core/decode/decoding.hpp"

namespace slsd {

/// Distance of a symbol from the place that the steps beside it predict. It is off the grid, as near as on one surface,
/// or so near that another surface is very unlikely.
enum class GridFit : std::uint8_t { kNone, kLoose, kTight };

/// Distance from the predicted place, in cells along the epipolar line. Another surface lies within it in one of sixty
/// cases at most.
inline constexpr float kTightSlip = 0.008F;
/// Slip above which a symbol belongs to another surface, even if the frame's surfaces bend strongly.
inline constexpr float kOffGridSlip = 0.1F;

/// A cell of the pattern proposed for a node, and the evidence for it around the node.
struct CellClaim {
  std::int16_t row = -1, column = -1;
  float margin_nats = 0;  ///< nats by which its cell is likelier than any other, up to the required margin
  RegionStatus status = RegionStatus::kNoNeighbour;  ///< kDecoded, or why not; decide() alone writes it
  GridFit grid_fit = GridFit::kTight;                ///< fit of a node at a boundary; nodes inside always fit
  DecodeRule rule = DecodeRule::kNoNeighbour;        ///< the rule that decided on the status
  DecodeRule guard = DecodeRule::kCertain;           ///< the last guard that kept it from being recovered, or kCertain

  struct Cell {
    int row, column;
    /// The adjacent cell in a direction.
    [[nodiscard]] Cell beyond(Direction d) const {
      return {row + (d == kDown) - (d == kUp), column + (d == kRight) - (d == kLeft)};
    }
  };

  void decide(DecodeRule by) { status = text_of(by).gives, rule = by; }
  /// @return  whether the guard allows recovery
  bool pass(const Rules& rules, DecodeRule by, bool holds) {
    const bool stopped = rules.apply(by, !holds);
    if (stopped) guard = by;
    return !stopped;
  }

  [[nodiscard]] bool named() const { return row >= 0; }
  [[nodiscard]] bool same_cell(int other_row, int other_column) const {
    return row == other_row && column == other_column;
  }
  [[nodiscard]] Cell cell() const { return {row, column}; }
  /// Tells whether a neighbour's cell lies beside its own as the neighbour does.
  [[nodiscard]] bool fits(const CellClaim& neighbour, Direction d) const {
    const Cell there = cell().beyond(d);
    return neighbour.same_cell(there.row, there.column);
  }
};

}  // namespace slsd
