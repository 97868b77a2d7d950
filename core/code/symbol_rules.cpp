// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/symbol_rules.hpp"

namespace slsd {
namespace {

constexpr std::int8_t i8(int value) {
  return static_cast<std::int8_t>(value);
}

constexpr Primitive rectangle(int left, int top, int right, int bottom) {
  return {Shape::kRectangle, true, {i8(left), i8(top), i8(right), i8(bottom), 0, 0}};
}
constexpr Primitive disc(int x, int y, int radius) {
  return {Shape::kDisc, true, {i8(x), i8(y), i8(radius), 0, 0, 0}};
}
constexpr Primitive triangle(int ax, int ay, int bx, int by, int cx, int cy) {
  return {Shape::kTriangle, true, {i8(ax), i8(ay), i8(bx), i8(by), i8(cx), i8(cy)}};
}
constexpr Primitive without(Primitive primitive) {
  primitive.lit = false;
  return primitive;
}

constexpr Primitive kMargin = without({Shape::kMargin, true, {1, 0, 0, 0, 0, 0}});

template <class... P>
constexpr SymbolRule rule(Symbol symbol, P... primitives) {
  return {symbol, static_cast<int>(sizeof...(P)), {primitives...}};
}

// Only the paper's symbols and those with short edges reach the cell's edge. The others leave a margin of a 24th, one
// pixel at 12, 14 and 16 px, if there is room: blur makes neighbours grow together across the spacing.
constexpr std::array<SymbolRule, kSymbolCount> kRules = {
    rule({1, "disc", "disc that fills the cell", false}, disc(12, 12, 12)),
    rule({2, "ring", "disc that fills the cell, without a disc of a third of its radius", false}, disc(12, 12, 12),
         without(disc(12, 12, 4))),
    rule({3, "frame", "square without a square of two fifths of its side", false}, rectangle(0, 0, 24, 24),
         without(rectangle(7, 7, 17, 17)), kMargin),
    rule({4, "plus", "horizontal and vertical bar, a third of the cell wide", false}, rectangle(0, 8, 24, 16),
         rectangle(8, 0, 16, 24)),
    rule({5, "diagonal squares", "squares of half the cell's side, top left and bottom right, touching in the middle",
          true},
         rectangle(0, 0, 12, 12), rectangle(12, 12, 24, 24)),
    rule({6, "cross", "square without a triangle in the middle of each side", false}, rectangle(0, 0, 24, 24),
         without(triangle(6, 0, 18, 0, 12, 8)), without(triangle(6, 24, 12, 16, 18, 24)),
         without(triangle(0, 6, 8, 12, 0, 18)), without(triangle(24, 6, 24, 18, 16, 12))),
    rule({7, "square", "square that fills the cell", false}, rectangle(0, 0, 24, 24)),
    rule({8, "diamond", "square on its corner, corners in the middle of the cell's sides", false},
         triangle(12, 0, 24, 12, 0, 12), triangle(0, 12, 24, 12, 12, 24)),
    rule({9, "small square", "square of half the cell's side in the middle", false}, rectangle(6, 6, 18, 18)),
    rule({10, "angle", "square without its top right quarter", true}, rectangle(0, 0, 24, 24),
         without(rectangle(12, 0, 24, 12)), kMargin),
    rule({11, "tee", "bar along the top, stem from its middle to the bottom", true}, rectangle(0, 0, 24, 9),
         rectangle(8, 9, 16, 24), kMargin),
    rule({12, "vertical bar", "as high as the cell, two fifths as wide, in the middle", true}, rectangle(7, 0, 17, 24)),
    rule({13, "cup", "square without a notch from the middle of its top", true}, rectangle(0, 0, 24, 24),
         without(rectangle(8, 0, 16, 15)), kMargin),
    rule({14, "chevron", "triangle that points up, without a notch from its base", true},
         triangle(12, 0, 24, 24, 0, 24), without(triangle(6, 24, 12, 12, 18, 24))),
    rule({15, "triangle up", "isosceles triangle, base along the bottom", true}, triangle(12, 0, 24, 24, 0, 24),
         kMargin),
    rule({16, "triangle right", "isosceles triangle, base along the left", true}, triangle(0, 0, 24, 12, 0, 24),
         kMargin),
    rule({17, "triangle down", "isosceles triangle, base along the top", true}, triangle(0, 0, 24, 0, 12, 24), kMargin),
    rule({18, "falling bar", "diagonal bar from the top left to the bottom right", true}, rectangle(0, 0, 24, 24),
         without(triangle(9, 0, 24, 0, 24, 15)), without(triangle(0, 9, 15, 24, 0, 24)), kMargin),
    rule({19, "rising bar", "diagonal bar from the bottom left to the top right", true}, rectangle(0, 0, 24, 24),
         without(triangle(0, 0, 15, 0, 0, 15)), without(triangle(24, 9, 24, 24, 9, 24)), kMargin),
    rule({20, "upper right triangle", "right isosceles triangle, right angle at the top right", true},
         triangle(0, 0, 24, 0, 24, 24), kMargin),
    rule({21, "rising squares", "squares of half the cell's side, top right and bottom left, touching in the middle",
          true},
         rectangle(12, 0, 24, 12), rectangle(0, 12, 12, 24)),
    rule({22, "horizontal bar", "as wide as the cell, two fifths as high, in the middle", true},
         rectangle(0, 7, 24, 17)),
    rule({23, "half disc", "disc without its upper part", true}, disc(12, 8, 12), without(rectangle(0, 0, 24, 8))),
    rule({24, "triangle left", "isosceles triangle, base along the right", true}, triangle(0, 12, 24, 0, 24, 24),
         kMargin),
    rule({25, "lower left triangle", "right isosceles triangle, right angle at the bottom left", true},
         triangle(0, 0, 24, 24, 0, 24)),
};

}  // namespace

const std::array<SymbolRule, kSymbolCount>& symbol_rules() {
  return kRules;
}

}  // namespace slsd
