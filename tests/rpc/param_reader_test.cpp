// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/param_reader.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(ParamReader, GivesValuesAndDefaults) {
  const json params{{"format", "pcd"}, {"timeout_ms", 7}, {"rate_hz", 2.5}, {"picture", true}};
  ParamReader reader(params);
  EXPECT_EQ(reader.choice("format", {"ply", "pcd"}), "pcd");
  EXPECT_EQ(reader.choice("transport", {"inline", "memfd"}), "inline");
  EXPECT_EQ(reader.integer("timeout_ms", 5000, 1, 60000), 7);
  EXPECT_EQ(reader.integer("count", 3, 1, 9), 3);
  EXPECT_EQ(reader.number("rate_hz", 0.5, 100), 2.5);
  EXPECT_TRUE(reader.boolean("picture", false));
  EXPECT_EQ(reader.text("camera"), "");
  EXPECT_FALSE(reader.error());
}

TEST(ParamReader, NamesTheNearestParameter) {
  const json params{{"formatt", "pcd"}};
  ParamReader reader(params);
  (void)reader.choice("format", {"ply", "pcd"});
  ASSERT_TRUE(reader.error());
  EXPECT_EQ(reader.error()->code, -32602);
  EXPECT_THAT(reader.error()->message, HasSubstr("did you mean format?"));
}

TEST(ParamReader, TakesAnyNumberThatIsWhole) {
  for (const char* text : {"5000", "5000.0", "5e3", "50000e-1", "5.000E+3"}) {
    const json params{{"timeout_ms", json::parse(text)}};
    ParamReader reader(params);
    EXPECT_EQ(reader.integer("timeout_ms", 1, 1, 60000), 5000) << text;
    EXPECT_FALSE(reader.error()) << text;
  }
}

TEST(ParamReader, RefusesWrongTypesAndRanges) {
  for (const json& value : {json(0), json(61), json(1.5), json(59.999999999), json(61.0), json(0.0), json("5"), json(),
                            json::array(), json(1e300), json(18446744073709551615ULL), json(-9223372036854775807LL)}) {
    const json params{{"timeout_ms", value}};
    ParamReader reader(params);
    EXPECT_EQ(reader.integer("timeout_ms", 5, 1, 60), 5);
    EXPECT_TRUE(reader.error()) << value;
  }
  for (const json& value : {json(0), json(-1), json(0.4999), json(1e-300), json(101), json("5")}) {
    const json params{{"rate_hz", value}};
    ParamReader reader(params);
    EXPECT_EQ(reader.number("rate_hz", 0.5, 100), std::nullopt);
    EXPECT_TRUE(reader.error()) << value;
  }
}

// It is likelier an unset variable than a wish for the default.
TEST(ParamReader, RefusesEmptyTexts) {
  for (const json& value : {json(""), json(), json(3), json("12345")}) {
    const json params{{"preset", value}};
    ParamReader reader(params);
    EXPECT_EQ(reader.text("preset", 4), "");
    ASSERT_TRUE(reader.error()) << value;
    EXPECT_THAT(reader.error()->message, HasSubstr("\"preset\" must be a string of 1 to 4 bytes")) << value;
  }
}

TEST(ParamReader, ReadsListsOfNumbers) {
  const auto read = [](const json& value, std::size_t count_min) {
    const json params{{"box", value}};
    ParamReader reader(params);
    auto numbers = reader.numbers("box", {count_min, 3, -10, 10});
    return std::pair(numbers, reader.error() ? reader.error()->message : std::string());
  };
  EXPECT_EQ(read({-10, 2.5, 10}, 1).first, (std::vector<double>{-10, 2.5, 10}));
  EXPECT_EQ(read(json::array(), 0).first, std::vector<double>());
  for (const json& value :
       {json::array(), json({1, 2, 3, 4}), json({1, 2, 10.1}), json({-10.1, 2, 3}), json({1, 2, "3"}),
        json({1, 2, nullptr}), json(1), json(), json("1"), json{{"a", 1}, {"b", 2}, {"c", 3}}}) {
    EXPECT_EQ(read(value, 1).first, std::nullopt) << value;
    EXPECT_THAT(read(value, 1).second, HasSubstr("\"box\" must be a list of 1 to 3 numbers from -10.0 to 10.0"))
        << value;
  }
  const json nothing = json::object();
  ParamReader reader(nothing);
  EXPECT_EQ(reader.numbers("box", {1, 3, -10, 10}), std::nullopt);
  EXPECT_FALSE(reader.error());
}

}  // namespace
}  // namespace slsd
