// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/code/pattern.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

Pattern small_pattern() {
  auto pattern = make_pattern({.projector_width_px = 640,
                               .projector_height_px = 360,
                               .symbols = {5, 7, 22, 25, 12},
                               .method = ArrayMethod::kConstructive,
                               .minimum_distance = 3});
  EXPECT_TRUE(pattern);
  return *pattern;
}

// The file of small_pattern() with one piece of text replaced.
std::string file_with(const std::string& piece, const std::string& other) {
  std::string text = write_pattern(small_pattern());
  const std::size_t at = text.find(piece);
  EXPECT_NE(at, std::string::npos) << piece;
  return text.replace(at, piece.size(), other);
}

std::string refusal(const std::string& text) {
  const auto pattern = read_pattern(text, "p.toml");
  return pattern ? "read" : to_string(pattern.error());
}

RC_GTEST_PROP(PatternFile, ReadsWhatItWrites, ()) {
  PatternOptions options;
  options.projector_width_px = *rc::gen::inRange(640, 900);
  options.projector_height_px = *rc::gen::inRange(360, 500);
  options.symbol_size_px = *rc::gen::element(8, 10, 12, 14, 16);
  options.spacing_px = *rc::gen::inRange(1, 17);
  options.symbols = *rc::gen::element(std::vector<int>{1, 2, 3, 4, 5}, std::vector<int>{25, 7, 22, 12, 8, 6, 3, 1});
  options.seed = *rc::gen::arbitrary<std::uint32_t>();
  options.method = *rc::gen::element(ArrayMethod::kPaper, ArrayMethod::kConstructive, ArrayMethod::kNoRepeats);
  if (options.method == ArrayMethod::kNoRepeats) {
    options.row_reach = *rc::gen::element(std::optional<int>(1), std::optional<int>(3));
    options.column_reach = *rc::gen::element(std::optional<int>(0), std::optional<int>(3));
    options.minimum_distance = 1;
  } else if (options.method == ArrayMethod::kConstructive) {
    options.minimum_distance = *rc::gen::element(std::optional<int>(1), std::optional<int>(2));
    options.half_turn_unique = *rc::gen::arbitrary<bool>() && options.symbols.size() > 5;
  }
  const auto pattern = make_pattern(options);
  RC_ASSERT(pattern.has_value());
  const auto read = read_pattern(write_pattern(*pattern), "p.toml");
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->array == pattern->array);
  RC_ASSERT(read->array.minimum_distance == minimum_window_distance(pattern->array, options.half_turn_unique));
  RC_ASSERT(read->options == pattern->options);
}

TEST(ReadPattern, NamesTheLineAndTheNearestKey) {
  EXPECT_EQ(refusal(file_with("spacing_px", "spacing_pix")),
            "p.toml:8: unknown key \"spacing_pix\"; the nearest known one is \"spacing_px\"");
}

TEST(ReadPattern, NamesAMissingKey) {
  EXPECT_EQ(refusal(file_with("seed = 1\n", "")), "p.toml:6: the key \"seed\" is missing here");
  EXPECT_THAT(refusal(""), HasSubstr("the key \"projector\" is missing"));
}

TEST(ReadPattern, NamesTheLineThatDoesNotParse) {
  EXPECT_THAT(refusal(file_with("seed = 1", "seed = ")), HasSubstr("p.toml:10: not a TOML file"));
}

TEST(ReadPattern, RefusesWrongTypesAndRanges) {
  EXPECT_THAT(refusal(file_with("seed = 1", "seed = \"1\"")), HasSubstr("whole number"));
  EXPECT_THAT(refusal(file_with("seed = 1", "seed = -1")), HasSubstr("from 0 to 4294967295"));
  EXPECT_THAT(refusal(file_with("symbol_size_px = 16", "symbol_size_px = 13")), HasSubstr("8, 10, 12, 14 or 16"));
  EXPECT_THAT(refusal(file_with("[5, 7, 22, 25, 12]", "[5, 7, 22, 25, 26]")), HasSubstr("1 to 25"));
  EXPECT_THAT(refusal(file_with("[5, 7, 22, 25, 12]", "[]")), HasSubstr("2 to 8 symbols"));
  EXPECT_THAT(refusal(file_with("\"constructive\"", "\"random\"")),
              HasSubstr("\"constructive\", \"no_repeats\" or \"paper\""));
  EXPECT_THAT(refusal(file_with("half_turn_unique = false", "half_turn_unique = 0")), HasSubstr("true or false"));
  EXPECT_THAT(refusal(file_with("[array]", "[[array]]")), HasSubstr("must be a table"));
}

TEST(ReadPattern, RefusesAnArrayOfAnotherSize) {
  EXPECT_THAT(refusal(file_with("rows = 21", "rows = 24")), HasSubstr("21 rows and 36 columns"));
  EXPECT_THAT(refusal(file_with("width_px = 640", "width_px = 1280")), HasSubstr("21 rows and 72 columns"));
}

TEST(ReadPattern, RefusesLettersThatThePatternLacks) {
  EXPECT_THAT(refusal(file_with("[5, 7, 22, 25, 12]", "[5, 7, 22, 25]")), HasSubstr("digits from 0 to 3"));
}

TEST(ReadPattern, RefusesAChangedLetter) {
  const Pattern pattern = small_pattern();
  Pattern changed = pattern;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      changed.array.cells[static_cast<std::size_t>((9 + row) * 36 + 9 + column)] =
          static_cast<std::uint8_t>(pattern.array.at(row, column));
  EXPECT_THAT(refusal(write_pattern(changed)), HasSubstr("a letter was changed"));
  changed.options.minimum_distance.reset();
  changed.array.minimum_distance = 0;
  EXPECT_THAT(refusal(write_pattern(changed)), HasSubstr("two windows of \"letters\" are equal"));
}

// 36 columns and 21 rows.
std::string file_without_repeats() {
  const auto pattern = make_pattern({.projector_width_px = 640,
                                     .projector_height_px = 360,
                                     .symbols = {5, 7, 22, 25, 12, 9},
                                     .method = ArrayMethod::kNoRepeats,
                                     .minimum_distance = 3,
                                     .row_reach = 30,
                                     .column_reach = 10});
  EXPECT_TRUE(pattern);
  return write_pattern(*pattern);
}

TEST(ReadPattern, RefusesRunsThatRecurSoonerThanPromised) {
  const std::string text = file_without_repeats();
  const std::size_t letters = text.find("letters = [") + 15;  // of the first row
  ASSERT_EQ(refusal(text), "read");
  std::string changed = text;
  changed.replace(letters + 20, 3, text.substr(letters, 3));
  EXPECT_THAT(refusal(changed), HasSubstr("recur after"));
  std::string promises_more = text;
  promises_more.replace(text.rfind("column_reach = ") + 15, 2, "19");
  EXPECT_THAT(refusal(promises_more), HasSubstr("sooner than the file states"));
  std::string asks_more = text;
  asks_more.replace(text.find("column_reach = ") + 15, 2, "19");
  EXPECT_THAT(refusal(asks_more), HasSubstr("sooner than the file states"));
}

TEST(ReadPattern, NeedsTheReachOfRunsOnlyWithoutRepeats) {
  std::string text = file_without_repeats();
  const std::size_t at = text.rfind("row_reach");
  EXPECT_THAT(refusal(text.substr(0, at) + text.substr(text.find('\n', at) + 1)),
              HasSubstr("the key \"row_reach\" is missing"));
  EXPECT_THAT(refusal(file_with("letters = [", "row_reach = 3\nletters = [")), HasSubstr("method = \"no_repeats\""));
  EXPECT_THAT(refusal(file_with("seed = 1", "seed = 1\nrow_reach = 3")), HasSubstr("method = \"no_repeats\""));
}

TEST(ReadPattern, RefusesRubbish) {
  EXPECT_THAT(refusal(std::string("\x89PNG\r\n\x1a\n\0\0", 10)), HasSubstr("p.toml:1"));
  EXPECT_THAT(refusal(std::string(2 << 20, '#')), HasSubstr("too large for a pattern file"));
  EXPECT_NE(refusal(std::string(1000, '[')), "read");
}

}  // namespace
}  // namespace slsd
