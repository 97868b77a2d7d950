// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/decode/lattice.hpp"

namespace slsd {

/// The light of a frame, as its decoded symbols show it. Decoding measures all of this anyway.
struct SymbolLight {
  std::optional<float> clipped_share = {};  ///< share of the symbols that reach the full level, 0 to 1; empty: none
                                            ///< were decoded
  std::optional<float> room_light = {};     ///< light between the symbols relative to what the projector adds, of the
                                            ///< usual symbol; empty: none were decoded
  std::optional<float> blur_px = {};        ///< blur at the frame's sharpest edges, one standard deviation; empty: there
                                            ///< are no edges
};

/// @param full          the level of a saturated pixel of the frame
/// @param edge_blur_px  0: there are no edges
/// @thread reentrant
[[nodiscard]] SymbolLight symbol_light(const Lattice& lattice, double full, float edge_blur_px);

}  // namespace slsd
