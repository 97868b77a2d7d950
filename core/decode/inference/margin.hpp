// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// The most that a margin can say, nats: a symbol inside a surface has so much.
inline constexpr float kMarginMax = 14;

/// The margin that a cell needs, nats.
/// @param wrong_cells_max  wrong cells that a frame may have on average, if it is made to mislead; over 0
[[nodiscard]] float margin_for(double wrong_cells_max);

/// The share of cells of a margin that are wrong, in frames made to mislead. Both are fitted to docs/decoder.md's
/// table.
/// @param margin_nats  of the cell, on its epipolar line
[[nodiscard]] double wrong_share(float margin_nats);

}  // namespace slsd
