// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/line_buffer.hpp"

#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

TEST(LineBuffer, CutsLinesAndKeepsTheRest) {
  LineBuffer lines(10);
  lines.append("one\r\ntw");
  EXPECT_EQ(lines.next_line(), "one");
  EXPECT_EQ(lines.next_line(), std::nullopt);
  lines.append("o\n\nthree");
  EXPECT_EQ(lines.next_line(), "two");
  EXPECT_EQ(lines.next_line(), "");
  EXPECT_EQ(lines.next_line(), std::nullopt);
  EXPECT_EQ(lines.rest(), "three");
  EXPECT_EQ(lines.rest(), std::nullopt);
}

TEST(LineBuffer, TakesALineAsLongAsTheLimitAndNoLonger) {
  LineBuffer lines(4);
  lines.append("abcd\n");
  EXPECT_EQ(lines.next_line(), "abcd");
  lines.append("abcd");
  EXPECT_EQ(lines.next_line(), std::nullopt);
  EXPECT_FALSE(lines.overflown());
  lines.append("e\n");
  EXPECT_EQ(lines.next_line(), std::nullopt);
  EXPECT_TRUE(lines.overflown());
}

TEST(LineBuffer, ManyShortLinesDoNotOverflow) {
  LineBuffer lines(4);
  lines.append("a\nb\nc\nd\ne\n");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(lines.next_line());
  EXPECT_FALSE(lines.overflown());
}

// A chunk of line feeds alone cost the square of their number: a minute for these.
TEST(LineBuffer, TakesATimeThatGrowsWithTheBytesAlone) {
  constexpr std::size_t kLines = 4 << 20;
  LineBuffer lines(1000);
  lines.append(std::string(kLines, '\n'));
  std::size_t count = 0;
  while (lines.next_line()) ++count;
  EXPECT_EQ(count, kLines);
}

TEST(LineBuffer, GivesItsMemoryBack) {
  LineBuffer lines(4 << 20);
  lines.append(std::string(2 << 20, 'x') + "\n");
  EXPECT_TRUE(lines.next_line());
  EXPECT_FALSE(lines.next_line());
  EXPECT_LT(lines.capacity(), 1U << 20);
}

// However the bytes are cut on their way, the lines are those of the whole.
RC_GTEST_PROP(LineBuffer, GivesTheSameLinesHoweverTheBytesCome, ()) {
  const auto text = *rc::gen::container<std::string>(rc::gen::element('a', 'b', '\n'));
  LineBuffer lines(1000);
  std::vector<std::string> got;
  for (std::size_t at = 0; at < text.size();) {
    const auto size = *rc::gen::inRange<std::size_t>(1, 5);
    lines.append(std::string_view(text).substr(at, size));
    at += size;
    while (auto line = lines.next_line()) got.emplace_back(*line);
  }
  std::vector<std::string> expected;
  std::istringstream stream(text.substr(0, text.find_last_of('\n') + 1));
  for (std::string line; std::getline(stream, line);) expected.push_back(line);
  if (text.find('\n') == std::string::npos) expected.clear();
  RC_ASSERT(got == expected);
}

}  // namespace
}  // namespace slsd
