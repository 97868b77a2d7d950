// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_light.hpp"

#include <gmock/gmock.h>

#include "core/decode/decoder.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using ::testing::Optional;

LatticeSymbol lit(float background, float gain) {
  LatticeSymbol symbol{};
  symbol.background = background, symbol.gain = gain;
  return symbol;
}

TEST(SymbolLight, CountsSymbolsAtTheFullLevel) {
  const Lattice lattice{{lit(20, 100), lit(20, 231), lit(20, 232), lit(100, 200)}};
  EXPECT_THAT(symbol_light(lattice, 255, 1).clipped_share, Optional(0.5F));
  EXPECT_THAT(symbol_light(lattice, 4095, 1).clipped_share, Optional(0.F));
}

TEST(SymbolLight, TakesTheRoomsLightOfTheUsualSymbol) {
  EXPECT_THAT(symbol_light({{lit(50, 100), lit(10, 100), lit(300, 100)}}, 255, 1).room_light, Optional(0.5F));
  EXPECT_THAT(symbol_light({{lit(-2, 100)}}, 255, 1).room_light, Optional(0.F));
}

TEST(SymbolLight, IsEmptyWhereNothingWasSeen) {
  const SymbolLight none = symbol_light({}, 255, 0);
  EXPECT_EQ(none.clipped_share, std::nullopt);
  EXPECT_EQ(none.room_light, std::nullopt);
  EXPECT_EQ(none.blur_px, std::nullopt);
}

/// The light of a wall as its decoder sees it.
SymbolLight seen_of(const SimulationOptions& light) {
  static const Pattern pattern = *make_pattern({});
  static auto decoder = *Decoder::create(IndexedPattern(pattern), paper_rig(), 0, {});
  const Grey8 frame = simulate(draw_pattern(pattern), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}), light);
  return (*decoder.decode(frame.view(), 255))->light;
}

TEST(SymbolLight, FollowsTheScene) {
  const SymbolLight fine = seen_of({.dark = 40, .lit = 200, .blur_sigma_px = 0.8});
  EXPECT_THAT(fine.clipped_share, Optional(0.F));
  EXPECT_NEAR(fine.room_light.value(), 40. / 160, 0.06);
  const SymbolLight bright = seen_of({.dark = 40, .lit = 400, .blur_sigma_px = 0.8});
  EXPECT_GT(bright.clipped_share.value(), 0.9);
  const SymbolLight blurred = seen_of({.dark = 40, .lit = 200, .blur_sigma_px = 2});
  EXPECT_NEAR(blurred.blur_px.value(), 2, 0.5);
  EXPECT_LT(fine.blur_px.value(), 1.2);
}

}  // namespace
}  // namespace slsd
