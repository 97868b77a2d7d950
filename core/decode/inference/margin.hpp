// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Largest margin, nats: that of a symbol inside a surface.
inline constexpr float kMarginMax = 14;

/// The margin that a cell needs, nats.
/// @param wrong_cells_max  mean number of wrong cells that a frame may have, if it is made to mislead; above 0
[[nodiscard]] float margin_for(double wrong_cells_max);

/// The share of wrong cells among those with a margin, in frames made to mislead. Both constants are fitted to the
/// table in docs/decoder.md.
/// @param margin_nats  margin of the cell, on its epipolar line
[[nodiscard]] double wrong_share(float margin_nats);

}  // namespace slsd
