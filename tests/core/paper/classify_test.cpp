// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/classify.hpp"

#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "core/code/symbol.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

const std::vector<std::vector<int>> kChoices{{5, 7, 22}, {25, 7, 22}, {5, 7, 22, 25, 12}};

TEST(MakeThresholds, TellsEveryDrawnSymbolAtEverySize) {
  for (const auto& symbols : kChoices) {
    for (const int size_px : kSymbolSizesPx) {
      const auto letters = make_thresholds(symbols, size_px);
      ASSERT_TRUE(letters) << letters.error().message;
      for (std::size_t i = 0; i < symbols.size(); ++i) {
        const Descriptors shape = describe_shape(draw_symbol(symbols[i], size_px));
        EXPECT_EQ(classify_paper(shape, *letters, size_px), static_cast<int>(i)) << symbols[i] << " at " << size_px;
      }
    }
  }
}

Grey8 magnify(const Grey8& drawn, int factor) {
  const cv::Mat1b image(drawn.height(), drawn.width(), const_cast<std::uint8_t*>(drawn.data()));
  Grey8 larger(factor * drawn.width(), factor * drawn.height());
  cv::Mat1b view(larger.height(), larger.width(), larger.data());
  cv::resize(255 * image, view, view.size(), 0, 0, cv::INTER_LINEAR);
  view = view > 127;
  return larger;
}

TEST(MakeThresholds, AreFreeOfScale) {
  const std::vector<int> symbols{5, 7, 22, 25, 12};
  const auto letters = make_thresholds(symbols, 16);
  ASSERT_TRUE(letters);
  for (const int factor : {2, 3}) {
    for (std::size_t i = 0; i < symbols.size(); ++i) {
      const Descriptors shape = describe_shape(magnify(draw_symbol(symbols[i], 16), factor));
      EXPECT_EQ(classify_paper(shape, *letters, 16 * factor), static_cast<int>(i)) << symbols[i];
    }
  }
}

TEST(MakeThresholds, SeparatesAsThePapersTable6) {
  const auto letters = make_thresholds(std::vector<int>{5, 7, 22}, 16);
  ASSERT_TRUE(letters);
  constexpr int kRectangularity = 0, kEccentricity = 1;
  EXPECT_NEAR((*letters)[0].intervals[kRectangularity].high, 0.75, 0.01);
  EXPECT_NEAR((*letters)[1].intervals[kRectangularity].low, 0.75, 0.01);
  EXPECT_LT((*letters)[1].intervals[kEccentricity].high, (*letters)[2].intervals[kEccentricity].low + 1e-12);
}

TEST(MakeThresholds, RefusesSymbolsWithTheSameDescriptors) {
  const auto letters = make_thresholds(std::vector<int>{7, 20, 25}, 16);
  ASSERT_FALSE(letters);
  EXPECT_EQ(letters.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(letters.error().message, HasSubstr("20 and 25"));
}

TEST(ClassifyPaper, AShapeBetweenTheLettersIsNone) {
  const auto letters = make_thresholds(std::vector<int>{5, 7, 22}, 16);
  ASSERT_TRUE(letters);
  // Rectangular as a bar, round as a square, small as neither.
  EXPECT_EQ(classify_paper(describe_shape(Grey8(5, 5, 1)), *letters, 16), -1);
  EXPECT_EQ(classify_paper(describe_shape(draw_symbol(3, 16)), *letters, 16), -1);
}

}  // namespace
}  // namespace slsd
