// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>

namespace slsd {

/// A decoded symbol: its cell of the pattern, and its place along the camera's rows.
struct SymbolPlace {
  int column = 0, row = 0;
  double x_px = 0;
};

/// Distance of neighbouring columns of symbols in a camera's frame, and how far they lie from where their neighbours
/// put them. A scaler in the projector makes columns unequally wide, which no calibration contains.
struct PatternPitch {
  double pitch_px = 0;
  double unevenness_px = 0;  ///< one standard deviation of a column's displacement

  [[nodiscard]] bool is_uneven() const { return unevenness_px > 0.005 * pitch_px; }
};

/// Measures the pitch along the rows. A column's displacement is that of its symbols from the cubic through two
/// neighbours on either side, which a smooth surface follows. Only the part that odd and even rows have in common
/// counts. Medians keep depth edges out.
/// @param symbols  each cell at most once
/// @return         empty with too few rows and columns
/// @thread         reentrant
[[nodiscard]] std::optional<PatternPitch> measure_pitch(std::span<const SymbolPlace> symbols);

}  // namespace slsd
