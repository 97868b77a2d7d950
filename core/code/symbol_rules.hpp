// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/code/alphabet.hpp"

namespace slsd {

/// Units along a cell's side in the rules below: every edge is a whole number of 24ths of the cell.
inline constexpr int kRuleUnits = 24;

enum class Shape : std::uint8_t {
  kRectangle,  ///< a, b: left and top; c, d: right and bottom
  kDisc,       ///< a, b: centre; c: radius
  kTriangle,   ///< a, b; c, d; e, f: corners, clockwise on the screen
  kMargin,     ///< a: covers all points at most this far from one of the cell's edges
};

/// One step of a symbol's rule: lights the area that it covers, or makes it dark again.
struct Primitive {
  Shape shape;
  bool lit;
  std::array<std::int8_t, 6> units;
};

inline constexpr int kMaxPrimitives = 5;

/// A symbol and its drawing rule: primitives in order. A pixel belongs to a primitive if the pixel's centre lies in it
/// or on its edge. The arithmetic is in exact integers, so symmetric rules give symmetric pixels.
struct SymbolRule {
  Symbol symbol;
  int count;
  std::array<Primitive, kMaxPrimitives> primitives;
};

/// The alphabet; the index is the number minus one.
[[nodiscard]] const std::array<SymbolRule, kSymbolCount>& symbol_rules();

}  // namespace slsd
