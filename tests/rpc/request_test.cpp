// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/request.hpp"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "rpc/message.hpp"

namespace slsd {
namespace {

int code_of(std::string_view line) {
  const auto request = parse_request(line);
  return request ? 0 : request.error().error.code;
}

TEST(ParseRequest, ReadsIdMethodAndParams) {
  const auto request = parse_request(R"({"jsonrpc":"2.0","id":"a","method":"scan","params":{"format":"pcd"}})");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->id, "a");
  EXPECT_TRUE(request->wants_reply);
  EXPECT_EQ(request->method, "scan");
  EXPECT_EQ(request->params["format"], "pcd");
}

TEST(ParseRequest, WithoutIdWantsNoReply) {
  const auto request = parse_request(R"({"jsonrpc":"2.0","method":"status"})");
  ASSERT_TRUE(request);
  EXPECT_FALSE(request->wants_reply);
  EXPECT_TRUE(request->params.is_object());
}

TEST(ParseRequest, TakesNothingForNoParameters) {
  for (const char* nothing : {"null", "[]", "{}"}) {
    const auto request = parse_request(R"({"jsonrpc":"2.0","method":"status","params":)" + std::string(nothing) + "}");
    ASSERT_TRUE(request);
    EXPECT_TRUE(request->params.is_object());
  }
}

TEST(ParseRequest, TellsWhatIsWrong) {
  EXPECT_EQ(code_of(""), -32700);
  EXPECT_EQ(code_of("{"), -32700);
  EXPECT_EQ(code_of("\xff"), -32700);
  EXPECT_EQ(code_of("[]"), -32600);
  EXPECT_EQ(code_of("1"), -32600);
  EXPECT_EQ(code_of("{}"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":2.0,"method":"status"})"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":[]})"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":true,"method":"status"})"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":"status","params":3})"), -32602);
}

TEST(ParseRequest, AnswersToTheIdWhereItCanBeRead) {
  const auto request = parse_request(R"({"jsonrpc":"2.0","id":7})");
  ASSERT_FALSE(request);
  EXPECT_EQ(request.error().id, 7);
}

TEST(ParseRequest, RefusesTwoMembersOfOneName) {
  for (const char* line : {R"({"jsonrpc":"2.0","id":7,"method":"scan","method":"status"})",
                           R"({"jsonrpc":"2.0","id":7,"method":"scan","params":{"stride":1,"stride":2}})",
                           R"({"jsonrpc":"2.0","id":7,"method":"scan","params":{"stride":1,"strid\u0065":1}})",
                           R"({"jsonrpc":"2.0","id":7,"method":"scan","params":{"a":[{},{"b":{"c":1},"b":2}]}})"}) {
    const auto request = parse_request(line);
    ASSERT_FALSE(request) << line;
    EXPECT_EQ(request.error().error.code, -32600) << line;
    EXPECT_EQ(request.error().id, 7) << line;
    EXPECT_THAT(request.error().error.message, ::testing::HasSubstr("twice")) << line;
  }
  const auto two_ids = parse_request(R"({"jsonrpc":"2.0","id":7,"id":8,"method":"status"})");
  ASSERT_FALSE(two_ids);
  EXPECT_EQ(two_ids.error().id, nullptr);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":"scan","params":{"a":{"b":1},"b":{"b":[{"b":1},{"b":1}]}}})"), 0);
}

TEST(ParseRequest, RefusesWhatFollowsANullCharacter) {
  using namespace std::string_view_literals;
  EXPECT_EQ(code_of("{\"jsonrpc\":\"2.0\",\"method\":\"status\"}\0"sv), -32700);
  EXPECT_EQ(code_of("{\"jsonrpc\":\"2.0\",\"method\":\"status\"}\0, \"params\""sv), -32700);
}

TEST(ParseRequest, RefusesIdsThatItCannotRepeat) {
  const auto with_id = [](const std::string& id) {
    return parse_request(R"({"jsonrpc":"2.0","method":"status","id":)" + id + "}");
  };
  for (const char* id : {"18446744073709551615", "-9223372036854775808", "9007199254740993", "0.5", "1e5"})
    EXPECT_TRUE(with_id(id)) << id;
  for (const char* id : {"18446744073709551616", "-9223372036854775809", "1e300", "9007199254740993.0"}) {
    ASSERT_FALSE(with_id(id)) << id;
    EXPECT_EQ(with_id(id).error().error.code, -32600) << id;
    EXPECT_EQ(with_id(id).error().id, nullptr) << id;
  }
}

TEST(ParseRequest, BoundsTheDepth) {
  EXPECT_EQ(code_of(std::string(1000000, '[')), -32700);
  const std::string deep = std::string(kMaxNesting - 2, '[') + std::string(kMaxNesting - 2, ']');
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":"status","params":{"a":)" + deep + "}}"), 0);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":"status","params":{"a":[)" + deep + "]}}"), -32700);
}

TEST(ParseRequest, BoundsTheNumberOfValues) {
  const auto with_values = [](int count) {
    std::string values = "0";
    for (int i = 1; i < count; ++i) values += ",0";
    return R"({"jsonrpc":"2.0","method":"status","params":{"a":[)" + values + "]}}";
  };
  EXPECT_EQ(code_of(with_values(kMaxValues - 10)), 0);
  EXPECT_EQ(code_of(with_values(kMaxValues)), -32700);
  EXPECT_EQ(code_of("[" + std::string(1000000, ',')), -32700);
}

TEST(ShapeOf, PassesOverTexts) {
  EXPECT_EQ(shape_of(R"({"[[[": "\"[[[,,"})").depth, 1);
  EXPECT_EQ(shape_of(R"({"[[[": "\"[[[,,"})").values, 2);
  EXPECT_EQ(shape_of("[[],[[]]]").depth, 3);
  EXPECT_EQ(shape_of("[1,[2,3]]").values, 5) << "an upper bound, as an empty array is counted with an element";
  EXPECT_EQ(shape_of("").depth, 0);
  EXPECT_TRUE(shape_of(R"({"a\"{":[1]})").closed);
  for (const char* open : {"{", "[[]", "\"", "{\"a\":\"}", "]"}) EXPECT_FALSE(shape_of(open).closed) << open;
}

RC_GTEST_PROP(ParseRequest, SurvivesAnyBytes, (const std::string& line)) {
  const auto request = parse_request(line);
  if (!request) RC_ASSERT(to_line(error_message(request.error().id, request.error().error)).back() == '\n');
}

TEST(ToLine, ReplacesWhatIsNoUtf8) {
  EXPECT_EQ(to_line({{"file", "a\xff"}}), "{\"file\":\"a\xef\xbf\xbd\"}\n");
}

TEST(RpcCode, IsTheSameNumberForGood) {
  constexpr std::string_view kNames[] = {"invalid_argument", "malformed",    "mismatch",
                                         "impossible",       "not_found",    "permission_denied",
                                         "already_exists",   "no_space",     "io",
                                         "unsupported",      "busy",         "timeout",
                                         "cancelled",        "disconnected", "frame_dropped",
                                         "frame_torn",       "frame_stale",  "frame_late",
                                         "frame_skewed"};
  for (int index = 0; index < static_cast<int>(std::size(kNames)); ++index) {
    EXPECT_EQ(to_string(static_cast<ErrorCode>(index)), kNames[index]);
    EXPECT_EQ(rpc_code(static_cast<ErrorCode>(index)), -32001 - index);
  }
}

}  // namespace
}  // namespace slsd
