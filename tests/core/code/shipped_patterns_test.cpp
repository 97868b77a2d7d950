// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iterator>
#include <ostream>

#include <gtest/gtest.h>

#include "core/code/pattern.hpp"
#include "tests/core/code/naive_runs.hpp"

namespace slsd {
namespace {

constexpr ArrayMethod kConstructive = ArrayMethod::kConstructive, kNoRepeats = ArrayMethod::kNoRepeats;

struct Shipped {
  const char* name;
  PatternOptions options;
  int rows, columns, distance;
  int row_reach = 0, column_reach = 0;
};

void PrintTo(const Shipped& shipped, std::ostream* out) {
  *out << shipped.name;
}

const Shipped kShipped[] = {
    {"paper-1", {.symbols = {5, 7, 22}, .method = ArrayMethod::kPaper}, 45, 72, 0},
    {"paper-2", {.symbols = {25, 7, 22}, .method = ArrayMethod::kPaper}, 45, 72, 0},
    {"16px-5", {.symbols = {11, 13, 14, 18, 19}, .method = kConstructive}, 45, 72, 3},
    {"14px-5", {.symbol_size_px = 14, .symbols = {11, 13, 14, 16, 24}, .method = kConstructive}, 51, 81, 3},
    {"12px-6", {.symbol_size_px = 12, .symbols = default_symbols(12), .method = kConstructive}, 60, 93, 3},
    {"10px-6", {.symbol_size_px = 10, .symbols = default_symbols(10), .method = kConstructive}, 69, 108, 3},
    {"8px-6", {.symbol_size_px = 8, .symbols = default_symbols(8), .method = kConstructive}, 81, 129, 3},
    {"8px-6-dense",
     {.symbol_size_px = 8, .spacing_px = 1, .symbols = default_symbols(8), .method = kConstructive},
     90,
     144,
     3},
    {"16px-6-no-repeats", {.symbols = {9, 11, 13, 14, 18, 19}, .method = kNoRepeats}, 45, 72, 3, 69, 15},
    {"14px-6-no-repeats",
     {.symbol_size_px = 14, .symbols = {11, 12, 13, 14, 16, 24}, .method = kNoRepeats},
     51,
     81,
     3,
     78,
     0},
    {"12px-6-no-repeats",
     {.symbol_size_px = 12, .symbols = default_symbols(12), .method = kNoRepeats},
     60,
     93,
     3,
     60,
     5},
    {"10px-6-no-repeats",
     {.symbol_size_px = 10, .symbols = default_symbols(10), .method = kNoRepeats},
     69,
     108,
     3,
     55,
     0},
    {"8px-6-no-repeats", {.symbol_size_px = 8, .symbols = default_symbols(8), .method = kNoRepeats}, 81, 129, 3, 40, 0},
    {"8px-6-dense-no-repeats",
     {.symbol_size_px = 8, .spacing_px = 1, .symbols = default_symbols(8), .method = kNoRepeats},
     90,
     144,
     3,
     30,
     0},
};

std::string text_of(const std::string& name) {
  std::ifstream stream(std::string(SLSD_SOURCE_DIR) + "/config/patterns/" + name + ".toml", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class ShippedPattern : public ::testing::TestWithParam<Shipped> {};

TEST_P(ShippedPattern, IsWhatMakePatternGives) {
  const Shipped& shipped = GetParam();
  const auto made = make_pattern(shipped.options);
  ASSERT_TRUE(made) << to_string(made.error());
  EXPECT_EQ(write_pattern(*made), text_of(shipped.name));
}

TEST_P(ShippedPattern, ReadsAndKeepsItsDistance) {
  const Shipped& shipped = GetParam();
  const auto read = read_pattern(text_of(shipped.name), shipped.name);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->array.rows, shipped.rows);
  EXPECT_EQ(read->array.columns, shipped.columns);
  EXPECT_GE(minimum_window_distance(read->array), shipped.distance);
  EXPECT_EQ(read->options, shipped.options);
  if (shipped.options.method != kNoRepeats) return;
  EXPECT_GE(naive_row_reach(read->array), shipped.row_reach);
  EXPECT_GE(naive_row_reach(naive_transposed(read->array)), shipped.column_reach);
}

INSTANTIATE_TEST_SUITE_P(Patterns, ShippedPattern, ::testing::ValuesIn(kShipped), [](const auto& test) {
  std::string name = test.param.name;
  for (char& letter : name)
    if (letter == '-') letter = '_';
  return name;
});

}  // namespace
}  // namespace slsd
