// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/toml/table_reader.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace std::string_view_literals;

constexpr std::array kSizes{std::pair("small"sv, 1), std::pair("large"sv, 2)};

/// Reads a table with every type of key.
struct Options {
  bool flag = false;
  int number = 1;
  std::optional<double> ratio;
  std::string name = "none";
  std::filesystem::path file;
  std::vector<double> list;
  int size = 1;
  std::optional<std::pair<int, int>> both;

  Result<> read(std::string_view text, Result<> valid = {}) {
    const toml::table document = toml::parse(text);
    TableReader reader(&document, "[here]", "/etc/a.toml");
    reader.read("flag", flag);
    reader.read("number", number);
    reader.read("ratio", ratio);
    reader.read("name", name);
    reader.read("file", file);
    reader.read("list", list);
    reader.choose("size", size, kSizes);
    reader.read_both("width", "height", both);
    return reader.finish(std::move(valid));
  }
};

TEST(TableReader, KeepsTheDefaultsOfMissingKeys) {
  Options options;
  ASSERT_TRUE(options.read(""));
  EXPECT_EQ(options.number, 1);
  EXPECT_EQ(options.name, "none");
  EXPECT_FALSE(options.ratio || options.both);
}

TEST(TableReader, ReadsEachType) {
  Options options;
  ASSERT_TRUE(
      options.read("flag = true\nnumber = -2\nratio = 3\nname = 'n'\nfile = 'b/c'\nlist = [1, 2.5]\n"
                   "size = 'large'\nwidth = 4\nheight = 5"));
  EXPECT_TRUE(options.flag);
  EXPECT_EQ(options.number, -2);
  EXPECT_EQ(options.ratio, 3.0);
  EXPECT_EQ(options.name, "n");
  EXPECT_EQ(options.file, "/etc/b/c") << "relative to the file's folder";
  EXPECT_THAT(options.list, ElementsAre(1, 2.5));
  EXPECT_EQ(options.size, 2);
  EXPECT_EQ(options.both, std::pair(4, 5));
}

TEST(TableReader, NamesThePlaceOfTheFirstWrongType) {
  const auto read = Options().read("number = 2.5\nname = 1");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "[here] number must be a whole number from -2147483648 to 2147483647");
  EXPECT_EQ(read.error().where, "/etc/a.toml:1:10");
}

TEST(TableReader, NamesTheWordsOfAChoice) {
  const auto read = Options().read("size = 'huge'");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "[here] size must be one of small, large");
}

TEST(TableReader, RefusesOneOfTwoThatGoTogether) {
  const auto read = Options().read("width = 4");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "[here] width needs height beside it");
}

TEST(TableReader, SuggestsAKeyForAnUnknownOneBeforeAllElse) {
  const auto read = Options().read("number = 'x'\nfalg = true");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("no such key in [here]: falg"));
  EXPECT_THAT(read.error().message, HasSubstr("flag"));
  EXPECT_EQ(read.error().where, "/etc/a.toml:2:1");
}

TEST(TableReader, PlacesTheErrorOfTheOptionsAtTheirKey) {
  const auto read = Options().read("\nnumber = 7", fail(ErrorCode::kInvalidArgument, "number must be even"));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "[here] number must be even");
  EXPECT_EQ(read.error().where, "/etc/a.toml:2:10");
}

}  // namespace
}  // namespace slsd
