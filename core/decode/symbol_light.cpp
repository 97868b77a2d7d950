// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_light.hpp"

#include <algorithm>

namespace slsd {

SymbolLight symbol_light(const Lattice& lattice, double full, float edge_blur_px) {
  constexpr double kClipped = 0.95;  // of full: the mean over a small symbol reaches its brightest pixels only so far
  SymbolLight light;
  if (edge_blur_px > 0) light.edge_px = edge_blur_px;
  const auto& symbols = lattice.symbols;
  if (symbols.empty()) return light;
  const auto clipped = std::ranges::count_if(
      symbols, [&](const LatticeSymbol& symbol) { return symbol.background + symbol.gain >= kClipped * full; });
  light.clipped_share = static_cast<float>(clipped) / static_cast<float>(symbols.size());
  return light;
}

}  // namespace slsd
