// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iterator>
#include <ostream>

#include <gtest/gtest.h>

#include "core/code/pattern.hpp"

namespace slsd {
namespace {

struct Shipped {
  const char* name;
  PatternOptions options;
  int rows, columns, distance;
};

void PrintTo(const Shipped& shipped, std::ostream* out) {
  *out << shipped.name;
}

const Shipped kShipped[] = {
    {"paper-1", {.symbols = {5, 7, 22}, .method = ArrayMethod::kPaper}, 45, 72, 0},
    {"paper-2", {.symbols = {25, 7, 22}, .method = ArrayMethod::kPaper}, 45, 72, 0},
    {"16px-5", {.symbols = default_symbols(16)}, 45, 72, 3},
    {"14px-5", {.symbol_size_px = 14, .symbols = default_symbols(14)}, 51, 81, 3},
    {"12px-6", {.symbol_size_px = 12, .symbols = default_symbols(12)}, 60, 93, 3},
    {"10px-6", {.symbol_size_px = 10, .symbols = default_symbols(10)}, 69, 108, 3},
    {"8px-6", {.symbol_size_px = 8, .symbols = default_symbols(8)}, 81, 129, 3},
    {"8px-6-dense", {.symbol_size_px = 8, .spacing_px = 1, .symbols = default_symbols(8)}, 90, 144, 3},
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
}

INSTANTIATE_TEST_SUITE_P(Patterns, ShippedPattern, ::testing::ValuesIn(kShipped), [](const auto& test) {
  std::string name = test.param.name;
  for (char& letter : name)
    if (letter == '-') letter = '_';
  return name;
});

}  // namespace
}  // namespace slsd
