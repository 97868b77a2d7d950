// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "clients/access/token.hpp"
#include "clients/tcp/address_range.hpp"
#include "clients/tcp/request_lines.hpp"

namespace slsd::tcp {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

const std::string kMemfd = R"({"jsonrpc":"2.0","id":7,"method":"scan","params":{"format":"pcd","transport":"memfd"}})";

/// Passes bytes that come in pieces of this size. @return what the service gets
std::string passed(std::string_view bytes, std::size_t piece) {
  RequestLines lines;
  std::string taken;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size()))) {
    lines.append(bytes.substr(0, piece));
    taken += lines.take();
  }
  return taken + lines.take_rest();
}

bool contains(const char* range, const char* address) {
  return AddressRange::parse(range)->contains(asio::ip::make_address(address));
}

TEST(RequestLines, AsksForCloudsInline) {
  EXPECT_EQ(json::parse(passed(kMemfd + "\n", 1000)),
            json::parse(R"({"jsonrpc":"2.0","id":7,"method":"scan","params":{"format":"pcd","transport":"inline"}})"));
  const auto silent = json::parse(passed(R"({"jsonrpc":"2.0","method":"scan","params":{"transport":"mem\u0066d"}})"
                                         "\n",
                                         1000));
  EXPECT_EQ(silent["params"]["transport"], "inline");
  for (const std::size_t piece : {1, 1000}) {
    const std::string last = passed("{}\n" + kMemfd, piece);  // ended by the connection's end
    EXPECT_EQ(json::parse(last.substr(3))["params"]["transport"], "inline");
  }
  EXPECT_FALSE(silent.contains("id"));
}

TEST(RequestLines, PassesEverythingElseUnchanged) {
  for (const char* line :
       {R"({"jsonrpc":"2.0","id":5e3,"method":"scan","params":{"timeout_ms":5e3}})",
        R"({"jsonrpc":"2.0","id":"memfd","method":"memfd","params":{"format":"memfd"}})",
        R"({"id":1,"method":"scan","params":{"transport":"memfd"}})", "memfd", "", "{", "\xff\x80\\"})
    EXPECT_EQ(passed(std::string(line) + "\n", 1000), std::string(line) + "\n") << line;
}

TEST(RequestLines, HoldsNoLineThatIsTooLong) {
  const std::string text(RequestLines::kLineBytesMax + 5000, 'x'), after = kMemfd + "\n";
  const std::string taken = passed(text + "\n" + after + text, 1 << 16);
  ASSERT_EQ(taken.substr(0, text.size() + 1), text + "\n");
  ASSERT_EQ(taken.substr(taken.size() - text.size()), text);
  EXPECT_EQ(json::parse(taken.substr(text.size() + 1, taken.size() - 2 * text.size() - 1))["params"]["transport"],
            "inline");
  RequestLines lines;
  for (int i = 0; i < 40; ++i) {
    lines.append(std::string(1 << 16, 'x'));
    (void)lines.take();
    ASSERT_LE(lines.size(), RequestLines::kLineBytesMax + 1);
  }
}

RC_GTEST_PROP(RequestLines, PassesTheSameHoweverItComes, ()) {
  std::string bytes;
  for (int parts = *rc::gen::inRange(1, 8); parts > 0; --parts)
    bytes += *rc::gen::element<std::string>("\n", "\r\n", "\r", kMemfd, "{}", "nonsense", "\\", "\"", kMemfd + "\n");
  const std::string whole = passed(bytes, bytes.size());
  for (std::size_t piece = 1; piece < bytes.size(); ++piece) RC_ASSERT(passed(bytes, piece) == whole);
}

TEST(ReadGreeting, FindsTheToken) {
  const auto greeting =
      read_greeting(R"({"jsonrpc":"2.0","id":4,"method":"authenticate","params":{"token":"secret"}})");
  ASSERT_TRUE(greeting);
  EXPECT_EQ(greeting->token, "secret");
  EXPECT_EQ(greeting->id, 4);
  EXPECT_TRUE(greeting->wants_reply);
  EXPECT_FALSE(read_greeting(R"({"jsonrpc":"2.0","method":"authenticate","params":{"token":"a"}})")->wants_reply);
}

TEST(ReadGreeting, TellsWhatIsMissing) {
  const auto error = [](const std::string& line) { return read_greeting(line).error(); };
  EXPECT_EQ(error(kMemfd).error.name, "permission_denied");
  EXPECT_EQ(error(kMemfd).id, 7);
  EXPECT_EQ(error("").error.name, "permission_denied");
  EXPECT_EQ(error(R"({"jsonrpc":"2.0","id":1,"method":"authenticate","params":{"tokne":"a"}})").error.name,
            "invalid_params");
  EXPECT_EQ(error(std::string(kGreetingBytesMax + 1, ' ')).error.name, "invalid_request");
}

TEST(AddressRange, ContainsWhatBeginsWithItsBits) {
  EXPECT_TRUE(contains("192.168.1.20", "192.168.1.20"));
  EXPECT_FALSE(contains("192.168.1.20", "192.168.1.21"));
  EXPECT_TRUE(contains("192.168.1.20/24", "192.168.1.255"));
  EXPECT_FALSE(contains("192.168.1.0/24", "192.168.2.0"));
  EXPECT_TRUE(contains("10.0.0.0/7", "11.2.3.4"));
  EXPECT_FALSE(contains("10.0.0.0/7", "12.0.0.0"));
  EXPECT_TRUE(contains("0.0.0.0/0", "8.8.8.8"));
  EXPECT_FALSE(contains("0.0.0.0/0", "fd00::1"));
  EXPECT_TRUE(contains("fd00::/8", "fdff::1"));
  EXPECT_FALSE(contains("fd00::/8", "fe00::1"));
  EXPECT_TRUE(contains("10.0.0.1", "::ffff:10.0.0.1"));
  EXPECT_TRUE(contains("::/0", "10.0.0.1"));
}

TEST(AddressRange, RefusesWhatIsNone) {
  for (const char* text :
       {"", "robot", "1.2.3", "1.2.3.4/", "1.2.3.4/33", "1.2.3.4/-1", "1.2.3.4/8x", "fd00::/129", "/8"})
    EXPECT_FALSE(AddressRange::parse(text)) << text;
}

TEST(TokenCheck, MakesThoseWaitWhoGuess) {
  TokenCheck check({"the right one", /*chosen=*/true});
  const TokenCheck::Clock::time_point begin{};
  using enum TokenCheck::Verdict;
  for (int i = 0; i < TokenCheck::kWrongMax; ++i) EXPECT_EQ(check.check("a", "wrong", begin), kWrong);
  EXPECT_EQ(check.check("a", "the right one", begin + 29s), kWait);
  EXPECT_EQ(check.check("b", "the right one", begin + 29s), kRight);
  EXPECT_EQ(check.check("a", "the right one", begin + 31s), kRight);
  EXPECT_EQ(check.check("a", "", begin + 31s), kWrong);
}

TEST(TokenCheck, ForgetsWrongOnesAfterTheRightOne) {
  TokenCheck check({"the right one", /*chosen=*/true});
  const TokenCheck::Clock::time_point now{};
  using enum TokenCheck::Verdict;
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(check.check("a", i % 4 == 3 ? "the right one" : "wrong", now), i % 4 == 3 ? kRight : kWrong);
}

}  // namespace
}  // namespace slsd::tcp
