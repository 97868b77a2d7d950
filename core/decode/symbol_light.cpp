// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_light.hpp"

#include <algorithm>

#include "core/geometry/robust.hpp"

namespace slsd {

SymbolLight symbol_light(const Lattice& lattice, double full, float edge_blur_px) {
  constexpr double kClipped = 0.985;  // of full, as for LightLevels::clipped_share
  SymbolLight light;
  if (edge_blur_px > 0) light.blur_px = edge_blur_px;
  const auto& symbols = lattice.symbols;
  if (symbols.empty()) return light;
  const auto clipped = std::ranges::count_if(
      symbols, [&](const LatticeSymbol& symbol) { return symbol.background + symbol.gain >= kClipped * full; });
  light.clipped_share = static_cast<float>(clipped) / static_cast<float>(symbols.size());
  light.room_light = usual_of(symbols.size(), [&](std::size_t i) {
    return symbols[i].gain > 0 ? std::max(symbols[i].background, 0.F) / symbols[i].gain : 0.F;
  });
  return light;
}

}  // namespace slsd
