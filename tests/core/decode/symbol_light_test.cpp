// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_light.hpp"

#include <gmock/gmock.h>

#include "core/decode/decoder.hpp"
#include "core/exposure/light_levels.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using ::testing::Optional;

LatticeSymbol lit(float background, float gain) {
  LatticeSymbol symbol{};
  symbol.background = background, symbol.gain = gain;
  return symbol;
}

TEST(SymbolLight, CountsSymbolsNearTheFullLevel) {
  const Lattice lattice{{lit(20, 100), lit(20, 222), lit(20, 223), lit(100, 200)}};
  EXPECT_THAT(symbol_light(lattice, 255, 1).clipped_share, Optional(0.5F));
  EXPECT_THAT(symbol_light(lattice, 4095, 1).clipped_share, Optional(0.F));
}

TEST(SymbolLight, IsEmptyIfNothingWasSeen) {
  const SymbolLight none = symbol_light({}, 255, 0);
  EXPECT_EQ(none.clipped_share, std::nullopt);
  EXPECT_EQ(none.edge_px, std::nullopt);
}

/// Of a wall that a decoder reads.
class SymbolLightOfAWall : public testing::Test {
 protected:
  Grey8 seen(double lit, double blur_sigma_px) const {
    return simulate(draw_pattern(pattern_), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}),
                    {.dark = 40, .lit = lit, .blur_sigma_px = blur_sigma_px});
  }
  SymbolLight light_of(const Grey8& frame) { return (*decoder_.decode(frame.view(), 255))->light; }

  const Pattern pattern_ = *make_pattern({});
  Decoder decoder_ = *Decoder::create(IndexedPattern(pattern_), paper_rig(), 0, {});
};

TEST_F(SymbolLightOfAWall, SeesClippingAsTheTilesOfTheFrameDo) {
  for (const double lit : {200, 240, 280, 400}) {
    const Grey8 frame = seen(lit, 0.8);
    EXPECT_NEAR(light_of(frame).clipped_share.value(), measure_light(frame.view(), 255).clipped_share, 0.02) << lit;
  }
}

TEST_F(SymbolLightOfAWall, SeesBlurAsTheTilesOfTheFrameDo) {
  for (const double blur_sigma_px : {0.5, 0.8, 1.5, 2.0}) {
    const Grey8 frame = seen(200, blur_sigma_px);
    const double tiles_px = measure_light(frame.view(), 255).edge_px;
    EXPECT_NEAR(light_of(frame).edge_px.value(), tiles_px, 0.1 * tiles_px) << blur_sigma_px;
  }
}

}  // namespace
}  // namespace slsd
