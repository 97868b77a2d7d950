// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/prototypes.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "core/code/pattern.hpp"
#include "core/code/symbol.hpp"
#include "core/regions/descriptors.hpp"

namespace slsd {
namespace {

PrototypeOptions options_of(std::vector<int> symbols) {
  PrototypeOptions options;
  options.symbols = std::move(symbols);
  return options;
}

TEST(MakePrototypes, ThinksOfEachSymbolAsItIsDrawn) {
  const std::vector<int> symbols{5, 7, 22, 25};
  const auto prototypes = make_prototypes(options_of(symbols));
  ASSERT_EQ(prototypes.size(), symbols.size());
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    const Descriptors drawn = describe_shape(draw_symbol(symbols[i], 16));
    EXPECT_NEAR(prototypes[i].mean[0], drawn.area_px / 256, 0.2 * drawn.area_px / 256) << symbols[i];
    const Eigen::Vector2d from_middle = drawn.centroid_px.array() - 7.5;
    EXPECT_NEAR((prototypes[i].centroid_px.cast<double>() - from_middle).norm(), 0, 0.25) << symbols[i];
  }
}

TEST(MakePrototypes, PutsTheTriangleASixthOffTheMiddle) {
  const auto prototypes = make_prototypes(options_of({25, 7}));
  EXPECT_NEAR(std::abs(prototypes[0].centroid_px.x()), 16. / 6, 0.25);
  EXPECT_NEAR(std::abs(prototypes[0].centroid_px.y()), 16. / 6, 0.25);
  EXPECT_NEAR(prototypes[1].centroid_px.norm(), 0, 0.05);
}

TEST(MakePrototypes, KeepsTheDefaultSymbolsApart) {
  for (const int size : kSymbolSizesPx) {
    PrototypeOptions options = options_of(default_symbols(size));
    options.symbol_size_px = size;
    const auto prototypes = make_prototypes(options);
    for (std::size_t a = 0; a < prototypes.size(); ++a) {
      for (std::size_t b = 0; b < prototypes.size(); ++b) {
        if (a == b) continue;
        EXPECT_GT(prototypes[a].squared_distance(prototypes[b].mean), 9) << size << ": " << a << ", " << b;
      }
      EXPECT_EQ(prototypes[a].squared_distance(prototypes[a].mean), 0);
    }
  }
}

TEST(MakePrototypes, GivesEachFrameErrorWhatItWouldGetAlone) {
  PrototypeOptions options = options_of({5, 7, 22});
  constexpr float kErrors[] = {0.15F, 0.05F};
  const auto together = make_prototypes(options, kErrors);
  for (std::size_t error = 0; error < 2; ++error) {
    options.frame_error = kErrors[error];
    const auto alone = make_prototypes(options);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_EQ(together[error][i].mean, alone[i].mean);
      EXPECT_EQ(together[error][i].whitening, alone[i].whitening);
      EXPECT_EQ(together[error][i].centroid_px, alone[i].centroid_px);
    }
  }
  EXPECT_NE(together[0][0].whitening, together[1][0].whitening);
}

TEST(MakePrototypes, GivesEachBlurWhatItWouldGetAlone) {
  PrototypeOptions options = options_of({5, 7, 22});
  const std::vector<std::optional<float>> blurs_px{std::nullopt, 0.45F, 2.0F};
  const auto together = make_prototypes(options, std::span(&options.frame_error, 1), blurs_px);
  for (std::size_t blur = 0; blur < blurs_px.size(); ++blur) {
    options.blur_px = blurs_px[blur];
    const auto alone = make_prototypes(options);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_EQ(together[blur][0][i].mean, alone[i].mean);
      EXPECT_EQ(together[blur][0][i].whitening, alone[i].whitening);
      EXPECT_EQ(together[blur][0][i].steady_centroid_px, alone[i].steady_centroid_px);
    }
  }
  EXPECT_NE(together[1][0][0].whitening, together[2][0][0].whitening);
}

TEST(MakePrototypes, GivesTheSameForTheSameOptions) {
  const auto once = make_prototypes(options_of({5, 7, 22}));
  const auto again = make_prototypes(options_of({5, 7, 22}));
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].mean, again[i].mean);
    EXPECT_EQ(once[i].whitening, again[i].whitening);
    EXPECT_EQ(once[i].centroid_px, again[i].centroid_px);
  }
}

TEST(MarginPx, StaysWithinHalfTheGap) {
  EXPECT_EQ(margin_px(1, 0.7F), 1);
  EXPECT_EQ(margin_px(2, 1.4F), 1);
  EXPECT_EQ(margin_px(4, 1.2F), 2);
  EXPECT_EQ(margin_px(16, 3), 2);
}

TEST(ThresholdLevel, IsLowWhereGapsAreWide) {
  EXPECT_FLOAT_EQ(threshold_level(16, 2, 1.4F), 0.25F);
  EXPECT_FLOAT_EQ(threshold_level(8, 2, 1.4F), 0.3F);
  EXPECT_FLOAT_EQ(threshold_level(16, 2, 0.7F), 0.45F);
}

}  // namespace
}  // namespace slsd
