// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/pattern.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

std::string refusal(PatternOptions options) {
  const auto valid = options.validate();
  return valid ? "valid" : valid.error().message;
}

TEST(MakePattern, TakesTheDefaultSymbolsWhereNoneAreNamed) {
  const auto pattern = make_pattern({});
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->options.symbols, default_symbols(16));
  EXPECT_EQ(pattern->array.rows, 45);
  EXPECT_EQ(pattern->array.columns, 72);
  EXPECT_GE(minimum_window_distance(pattern->array), 3);
}

TEST(MakePattern, CountsTheCellsThatAreShownWhole) {
  const auto pattern = make_pattern({});
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->whole_rows(), 44);
  EXPECT_EQ(pattern->whole_columns(), 71);
}

// Reads the letter of a cell back from the picture by comparing it with every symbol.
int letter_seen(const Grey8& image, const Pattern& pattern, int row, int column) {
  const int size_px = pattern.options.symbol_size_px;
  for (int letter = 0; letter < pattern.letters(); ++letter) {
    const Grey8 symbol_image = draw_symbol(pattern.options.symbols[static_cast<std::size_t>(letter)], size_px);
    bool equal = true;
    for (int y = 0; y < size_px; ++y)
      for (int x = 0; x < size_px; ++x)
        equal = equal && image.at(pattern.symbol_left_px(column) + x, pattern.symbol_top_px(row) + y) ==
                             (symbol_image.at(x, y) != 0 ? 255 : 0);
    if (equal) return letter;
  }
  return -1;
}

RC_GTEST_PROP(DrawPattern, ShowsEveryWholeCell, ()) {
  PatternOptions options;
  options.projector_width_px = *rc::gen::inRange(640, 800);
  options.projector_height_px = *rc::gen::inRange(360, 500);
  options.symbol_size_px = *rc::gen::element(8, 10, 12, 14, 16);
  options.spacing_px = *rc::gen::inRange(1, 17);
  options.symbols = {5, 7, 22, 25, 12};
  options.method = ArrayMethod::kConstructive;
  options.minimum_distance = 1;
  const auto pattern = make_pattern(options);
  RC_ASSERT(pattern.has_value());
  const Grey8 image = draw_pattern(*pattern);
  RC_ASSERT(image.width() == options.projector_width_px);
  RC_ASSERT(image.height() == options.projector_height_px);
  for (int row = 0; row < pattern->whole_rows(); ++row)
    for (int column = 0; column < pattern->whole_columns(); ++column)
      RC_ASSERT(letter_seen(image, *pattern, row, column) == pattern->array.at(row, column));
}

TEST(DrawPattern, LeavesTheSpacingDark) {
  const auto pattern = make_pattern({.symbols = {7, 22, 25}, .method = ArrayMethod::kPaper});
  ASSERT_TRUE(pattern);
  const Grey8 image = draw_pattern(*pattern);
  const auto in_spacing = [](int at_px) { return at_px % 18 == 0 || at_px % 18 == 17; };
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (in_spacing(x) || in_spacing(y)) {
        ASSERT_EQ(image.at(x, y), 0) << x << " " << y;
      }
    }
  }
}

TEST(DrawPattern, CutsWhatReachesBeyondTheProjector) {
  const auto pattern = make_pattern({.symbols = {7, 22, 25}, .method = ArrayMethod::kPaper});
  ASSERT_TRUE(pattern);
  EXPECT_GT(pattern->array.columns * pattern->pitch_px(), 1280);
  EXPECT_EQ(draw_pattern(*pattern).width(), 1280);
}

TEST(PatternOptions, RefusesWhatIsOutOfRange) {
  EXPECT_THAT(refusal({.projector_width_px = 639}), HasSubstr("640 to 3840"));
  EXPECT_THAT(refusal({.projector_height_px = 2161}), HasSubstr("360 to 2160"));
  EXPECT_THAT(refusal({.symbol_size_px = 9}), HasSubstr("8, 10, 12, 14 or 16"));
  EXPECT_THAT(refusal({.spacing_px = 0}), HasSubstr("1 to 16"));
  EXPECT_THAT(refusal({.symbols = {7}}), HasSubstr("2 to 8 symbols"));
  EXPECT_THAT(refusal({.symbols = {1, 2, 3, 4, 5, 6, 7, 8, 9}}), HasSubstr("2 to 8 symbols"));
  EXPECT_THAT(refusal({.symbols = {7, 26}}), HasSubstr("1 to 25, not 26"));
  EXPECT_THAT(refusal({.symbols = {7, 22, 7}}), HasSubstr("7 appears twice"));
  EXPECT_THAT(refusal({.minimum_distance = 10}), HasSubstr("1 to 9"));
}

TEST(PatternOptions, TakesEveryProjectorFromTheSmallestToTheLargest) {
  EXPECT_EQ(refusal({.projector_width_px = 640, .projector_height_px = 360}), "valid");
  EXPECT_EQ(refusal({.projector_width_px = 3840, .projector_height_px = 2160, .symbol_size_px = 8, .spacing_px = 1}),
            "valid");
}

TEST(DefaultSymbols, CarryDirectionAtEverySize) {
  for (const int size_px : kSymbolSizesPx) {
    const std::vector<int> symbols = default_symbols(size_px);
    EXPECT_EQ(symbols.size(), 6U);
    EXPECT_TRUE(std::ranges::any_of(symbols, [](int number) { return symbol(number).carries_direction; }));
  }
}

}  // namespace
}  // namespace slsd
