// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/decode/lattice.hpp"

namespace slsd {

/// The light of a frame, as its decoded symbols show it. Decoding measures all of this anyway.
struct SymbolLight {
  std::optional<float> clipped_share = {};  ///< share of the symbols within a twentieth of the full level, 0 to 1;
                                            ///< empty: none were decoded
  std::optional<float> edge_px = {};        ///< blur at the sharpest edges, one standard deviation, to a tenth as
                                            ///< LightLevels::edge_px; empty: there are no edges
};

/// @param full          the level of a saturated pixel of the frame
/// @param edge_blur_px  0: there are no edges
/// @thread reentrant
[[nodiscard]] SymbolLight symbol_light(const Lattice& lattice, double full, float edge_blur_px);

}  // namespace slsd
