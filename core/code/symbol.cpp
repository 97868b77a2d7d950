// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/symbol.hpp"

#include <algorithm>
#include <cassert>

#include "core/code/symbol_rules.hpp"

namespace slsd {
namespace {

/// Pixel centres and rule units on one integer lattice: 2 n kRuleUnits steps for a cell's side of n pixels.
struct Lattice {
  int size_px;
  [[nodiscard]] int of_pixel(int x_px) const { return (2 * x_px + 1) * kRuleUnits; }
  [[nodiscard]] int of_units(int units) const { return 2 * size_px * units; }
};

bool covers(const Primitive& p, const Lattice& lattice, int x, int y) {
  const auto at = [&](std::size_t i) { return lattice.of_units(p.units[i]); };
  // Not negative if (x, y) lies on the line from corner i to corner j, or to its right.
  const auto side = [&](std::size_t i, std::size_t j) {
    return (at(j) - at(i)) * (y - at(i + 1)) - (at(j + 1) - at(i + 1)) * (x - at(i));
  };
  switch (p.shape) {
    case Shape::kRectangle:
      return x >= at(0) && y >= at(1) && x <= at(2) && y <= at(3);
    case Shape::kDisc:
      return (x - at(0)) * (x - at(0)) + (y - at(1)) * (y - at(1)) <= at(2) * at(2);
    case Shape::kTriangle:
      return side(0, 2) >= 0 && side(2, 4) >= 0 && side(4, 0) >= 0;
    case Shape::kMargin:
      return std::min({x, y, lattice.of_units(kRuleUnits) - x, lattice.of_units(kRuleUnits) - y}) <= at(0);
  }
  return false;
}

bool is_lit(const SymbolRule& rule, const Lattice& lattice, int x, int y) {
  bool lit = false;
  for (int i = 0; i < rule.count; ++i) {
    const Primitive& primitive = rule.primitives[static_cast<std::size_t>(i)];
    if (covers(primitive, lattice, x, y)) lit = primitive.lit;
  }
  return lit;
}

const SymbolRule& rule_of(int number) {
  assert(number >= 1 && number <= kSymbolCount);
  return symbol_rules()[static_cast<std::size_t>(number - 1)];
}

}  // namespace

const Symbol& symbol(int number) {
  return rule_of(number).symbol;
}

Grey8 draw_symbol(int number, int size_px) {
  assert(std::ranges::find(kSymbolSizesPx, size_px) != std::end(kSymbolSizesPx));
  const SymbolRule& rule = rule_of(number);
  const Lattice lattice{size_px};
  Grey8 image(size_px, size_px);
  for (int y = 0; y < size_px; ++y)
    for (int x = 0; x < size_px; ++x)
      image.at(x, y) = is_lit(rule, lattice, lattice.of_pixel(x), lattice.of_pixel(y)) ? 1 : 0;
  return image;
}

}  // namespace slsd
