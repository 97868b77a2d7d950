// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/request.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <nlohmann/json.hpp>

#include <map>
#include <regex>
#include <string>
#include <vector>

namespace slsd::web {
namespace {

const std::string kHead = "POST /api/cloud?density=pixels&after=12 HTTP/1.1\r\nHost: 127.0.0.1:8384\r\n";

tl::expected<Request, Refusal> read(const std::string& head) {
  const HeadEnd end = find_head_end(head);
  if (end.refusal) return tl::unexpected(*end.refusal);
  if (end.bytes == 0) return tl::unexpected(Refusal{0, "more is to come", {}});
  return read_head(std::string_view(head).substr(0, end.bytes));
}

int status_of(const std::string& head) {
  const auto request = read(head);
  return request ? 200 : request.error().status;
}

/// The grammar of RFC 9112 for what is taken here, written a second time, as a whole.
bool has_one_meaning(const std::string& head) {
  static const std::regex kLine("(GET|HEAD|[!#$%&'*+.^_`|~0-9A-Za-z-]+) /[^ \\t#]* HTTP/1\\.[01]");
  static const std::regex kField("([!#$%&'*+.^_`|~0-9A-Za-z-]+):([^]*)");
  std::vector<std::string> lines;
  for (std::size_t at = 0, end = 0; at < head.size(); at = end + 2) {
    end = head.find("\r\n", at);
    if (end == std::string::npos) return false;
    lines.push_back(head.substr(at, end - at));
    if (lines.back().find_first_of("\r\n") != std::string::npos) return false;
  }
  std::smatch line, field;
  if (lines.size() < 2 || !lines.back().empty() || !std::regex_match(lines[0], line, kLine)) return false;
  int hosts = 0, lengths = 0;
  bool has_body = false;
  for (std::size_t i = 1; i + 1 < lines.size(); ++i) {
    if (!std::regex_match(lines[i], field, kField)) return false;
    std::string name = field[1], value = std::regex_replace(std::string(field[2]), std::regex("^[ \\t]+|[ \\t]+$"), "");
    for (char& letter : name) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    for (const char letter : value)
      if ((static_cast<unsigned char>(letter) < 0x20 && letter != '\t') || letter == 0x7f) return false;
    if (name == "transfer-encoding") return false;
    hosts += name == "host" && !value.empty();
    if (name != "content-length") continue;
    ++lengths;
    if (!std::regex_match(value, std::regex("[0-9]{1,20}"))) return false;
    has_body = value.find_first_not_of('0') != std::string::npos;
  }
  return hosts == 1 && lengths <= 1 && !(has_body && (line[1] == "GET" || line[1] == "HEAD"));
}

TEST(ReadHead, TellsWhoAsksForWhat) {
  const auto request =
      read(kHead +
           "Content-Length: 5\r\nCookie: a=b\r\nCookie: c=d\r\nOrigin: http://a\r\nX-Slsd-Page: key\r\n"
           "Authorization: Bearer secret\r\nX-Forwarded-Proto: https\r\n\r\n");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->method, "POST");
  EXPECT_EQ(request->path, "/api/cloud");
  EXPECT_EQ(request->query, (std::map<std::string, std::string>{{"density", "pixels"}, {"after", "12"}}));
  EXPECT_EQ(request->host, "127.0.0.1:8384");
  EXPECT_EQ(request->cookie, "a=b; c=d");
  EXPECT_EQ(request->origin, "http://a");
  EXPECT_EQ(request->page_key, "key");
  EXPECT_EQ(request->authorization, "Bearer secret");
  EXPECT_TRUE(request->by_https);
  EXPECT_TRUE(request->keep_alive);
  EXPECT_EQ(request->body_bytes, 5U);
}

TEST(ReadHead, DecodesParameters) {
  EXPECT_EQ(read("GET /?a=%2f%C3%A9&b&c=d+e HTTP/1.1\r\nHost: a\r\n\r\n")->query,
            (std::map<std::string, std::string>{{"a", "/\xC3\xA9"}, {"b", ""}, {"c", "d e"}}));
  for (const char* query : {"a=%", "a=%2", "a=%2x", "a=%x2", "a=%-1", "a=1&a=2"})
    EXPECT_EQ(status_of("GET /?" + std::string(query) + " HTTP/1.1\r\nHost: a\r\n\r\n"), 400) << query;
}

TEST(ReadHead, KeepsAConnectionAsItsVersionSays) {
  EXPECT_TRUE(read("GET / HTTP/1.1\r\nHost: a\r\n\r\n")->keep_alive);
  EXPECT_FALSE(read("GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")->keep_alive);
  EXPECT_FALSE(read("GET / HTTP/1.0\r\nHost: a\r\n\r\n")->keep_alive);
  EXPECT_TRUE(read("GET / HTTP/1.0\r\nHost: a\r\nConnection: keep-alive\r\n\r\n")->keep_alive);
}

TEST(FindHeadEnd, RefusesWhatIsTooLongBeforeItIsWhole) {
  EXPECT_EQ(find_head_end("GET /" + std::string(kRequestLineBytesMax, 'a')).refusal->status, 414);
  EXPECT_EQ(find_head_end("GET / HTTP/1.1\r\nX: " + std::string(kHeadBytesMax, 'a')).refusal->status, 431);
  EXPECT_FALSE(find_head_end("GET /" + std::string(kRequestLineBytesMax - 6, 'a')).refusal);
}

RC_GTEST_PROP(FindHeadEnd, FindsTheSameEndHoweverItComes, (std::uint8_t padding)) {
  const std::string head = kHead + "X: " + std::string(padding, 'x') + "\r\n\r\n", more = head + "GET /";
  for (std::size_t size = 0; size <= more.size(); ++size) {
    const HeadEnd end = find_head_end(std::string_view(more).substr(0, size));
    RC_ASSERT(!end.refusal);
    RC_ASSERT(end.bytes == (size < head.size() ? 0 : head.size()));
  }
}

// A head with some bytes put in, taken out or changed is taken only if it still has one meaning, and then has that.
RC_GTEST_PROP(ReadHead, TakesNothingThatHasTwoMeanings, ()) {
  static const std::vector<std::string> kParts{"\r",
                                               "\n",
                                               "\r\n",
                                               " ",
                                               "\t",
                                               ":",
                                               ",",
                                               std::string(1, '\0'),
                                               "\x7f",
                                               "\x80",
                                               "0",
                                               "7",
                                               "+",
                                               "-",
                                               "0x",
                                               "%",
                                               "#",
                                               "GET",
                                               "Content-Length: 3\r\n",
                                               "Content-Length: 5\r\n",
                                               "content-length:5\r\n",
                                               "Transfer-Encoding: chunked\r\n",
                                               "Transfer-Encoding: identity\r\n",
                                               "Host: b\r\n",
                                               "HTTP/1.0",
                                               "X: y\r\n",
                                               "Connection: close\r\n",
                                               "POST / HTTP/1.1\r\n"};
  std::string head = *rc::gen::element<std::string>("GET", "POST", "HEAD", "BREW") + " /a HTTP/1.1\r\nHost: a\r\n" +
                     *rc::gen::element<std::string>("", "Content-Length: 5\r\n", "X: y\r\n") + "\r\n";
  for (int changes = *rc::gen::inRange(1, 5); changes > 0; --changes) {
    const auto at = *rc::gen::inRange<std::size_t>(0, head.size() + 1);
    const auto gone = std::min(head.size() - at, *rc::gen::inRange<std::size_t>(0, 3));
    head.replace(at, gone, *rc::gen::elementOf(kParts));
  }
  const HeadEnd end = find_head_end(head);
  if (end.refusal || end.bytes == 0) return;
  head.resize(end.bytes);
  const auto request = read_head(head);
  if (!request) return RC_ASSERT(request.error().status == 400);
  RC_ASSERT(has_one_meaning(head));
  std::smatch length;
  const bool told =
      std::regex_search(head, length, std::regex("\r\ncontent-length:[ \\t]*([0-9]+)", std::regex::icase));
  RC_ASSERT(request->body_bytes == (told ? std::stoull(length[1]) : 0U));
  RC_ASSERT(head.starts_with(request->method + " " + request->path));
}

TEST(UnknownParameter, NamesTheNearestOfAQueryOrABody) {
  const std::vector<std::string> known{"density", "camera"};
  EXPECT_FALSE(unknown_parameter(std::map<std::string, std::string>{{"camera", ""}}, known));
  EXPECT_FALSE(unknown_parameter(nlohmann::json::object(), known));
  const auto query = unknown_parameter(std::map<std::string, std::string>{{"camera", ""}, {"densty", "pixels"}}, known);
  const auto body = unknown_parameter({{"camera", 1}, {"densty", "pixels"}}, known);
  ASSERT_TRUE(query && body);
  EXPECT_EQ(query->status, 400);
  EXPECT_EQ(query->name, "invalid_params");
  EXPECT_EQ(query->message, "no such parameter: \"densty\"; did you mean density?");
  EXPECT_EQ(body->message, query->message);
  EXPECT_EQ(unknown_parameter(nlohmann::json{{"\n", 0}}, known)->message.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace slsd::web
