// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/printable.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using namespace std::string_literals;

// Code points, by another way than the one under test; a mark of its own where the text is no UTF-8.
constexpr char32_t kNoUtf8 = 0xFFFFFFFF;
std::u32string code_points(const std::string& text) {
  std::u32string codes;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t at) -> unsigned {
      return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U;
    };
    const unsigned first = byte(i);
    const std::size_t size = first < 0x80 ? 1 : first >> 5 == 6 ? 2 : first >> 4 == 14 ? 3 : first >> 3 == 30 ? 4 : 0;
    if (size == 0 || i + size > text.size()) return {kNoUtf8};
    char32_t code = size == 1 ? first : first & (0x7FU >> size);
    for (std::size_t j = 1; j < size; ++j) {
      if (byte(i + j) >> 6 != 2) return {kNoUtf8};
      code = code << 6 | (byte(i + j) & 0x3F);
    }
    if ((size == 2 && code < 0x80) || (size == 3 && code < 0x800) || (size == 4 && code < 0x10000)) return {kNoUtf8};
    if (code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return {kNoUtf8};
    codes += code;
    i += size;
  }
  return codes;
}

bool harmless(char32_t code) {
  return code != kNoUtf8 && code >= 0x20 && !(code >= 0x7F && code < 0xA0) && !(code >= 0x2028 && code <= 0x202E) &&
         !(code >= 0x2066 && code <= 0x2069) && code != 0x200E && code != 0x200F && code != 0x061C && code != 0xFEFF;
}

bool harmless(const std::string& text) {
  const std::u32string codes = code_points(text);
  return std::all_of(codes.begin(), codes.end(), [](char32_t code) { return harmless(code); });
}

TEST(Printable, LeavesPrintableTextAsItIs) {
  for (const char* text : {"", "left", "Kamera \"links\" \\ rechts", "größe 3,4 µm", "カメラ 📷", "می\u200cخواهم"}) {
    EXPECT_EQ(printable(text), text);
  }
  EXPECT_EQ(printable(std::string(200, 'x')), std::string(200, 'x'));
}

TEST(Printable, ShowsWhatALogOrATerminalWouldObey) {
  EXPECT_EQ(printable("x\n<2>kernel panic"), "x\\n<2>kernel panic");
  EXPECT_EQ(printable("\r\t\x1b[2J\x7f"), "\\r\\t\\x1b[2J\\x7f");
  EXPECT_EQ(printable("a\0b"s), "a\\x00b");
  EXPECT_EQ(printable("\u0085\u009b31m"), "\\u0085\\u009b31m");
  EXPECT_EQ(printable("\u2028\u2029\u202egnp.exe\u2066\u200f\u061c\ufeff"),
            "\\u2028\\u2029\\u202egnp.exe\\u2066\\u200f\\u061c\\ufeff");
  EXPECT_EQ(printable("\U000e0041"), "\\ue0041");
}

TEST(Printable, ShowsBytesThatAreNoUtf8) {
  EXPECT_EQ(printable("\xff\xfe"), "\\xff\\xfe");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf") << "overlong";
  EXPECT_EQ(printable("\xe0\x80\xaf"), "\\xe0\\x80\\xaf") << "overlong";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond U+10FFFF";
  EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82") << "cut short";
  EXPECT_EQ(printable("\xc3("), "\\xc3(");
}

TEST(Printable, CutsWholeCharactersAndSaysSo) {
  EXPECT_EQ(printable("0123456789", 10), "0123456789");
  EXPECT_EQ(printable("0123456789a", 10), "0123456…");
  EXPECT_EQ(printable("012345ééé", 10), "012345…") << "é takes two bytes: the third would end at 12";
  EXPECT_EQ(printable("\n\n\n\n\n\n", 10), "\\n\\n\\n…");
  EXPECT_EQ(printable("long", 3), "…");
  EXPECT_EQ(printable("long", 2), "");
  EXPECT_EQ(printable(std::string(900'000, 'x')).size(), 200U);
}

RC_GTEST_PROP(Printable, AnyBytesBecomeHarmlessTextWithinTheLimit, (const std::string& bytes)) {
  const auto limit = *rc::gen::inRange<std::size_t>(0, 60);
  const std::string text = printable(bytes, limit);
  RC_ASSERT(harmless(text));
  RC_ASSERT(text.size() <= limit);
  RC_ASSERT(printable(text, limit) == text);
}

// Bytes drawn evenly are hardly ever the start of anything; these are, and are cut everywhere.
RC_GTEST_PROP(Printable, PiecesOfCharactersBecomeHarmlessText, ()) {
  const auto pieces = *rc::gen::container<std::vector<std::string>>(
      rc::gen::element("\xe2"s, "\x80"s, "\xa8"s, "\xae"s, "\xf0"s, "\x9f"s, "\xc2"s, "\x9b"s, "\xed"s, "\xa0"s,
                       "\xef"s, "\xbb"s, "\xbf"s, "\n"s, "a"s, "é"s, "📷"s, "\u202e"s, "\x1b[0m"s));
  std::string bytes;
  for (const std::string& piece : pieces) bytes += piece;
  const auto limit = *rc::gen::inRange<std::size_t>(0, 60);
  RC_ASSERT(harmless(printable(bytes, limit)));
  RC_ASSERT(printable(bytes, limit).size() <= limit);
}

RC_GTEST_PROP(Printable, HarmlessTextStaysAsItIs, ()) {
  const auto codes = *rc::gen::container<std::vector<std::string>>(
      rc::gen::element("a"s, " "s, "\\"s, "\""s, "é"s, "…"s, "カ"s, "📷"s, "\u200d"s, "\u00a0"s, "\uffee"s));
  std::string text;
  for (const std::string& code : codes) text += code;
  RC_ASSERT(printable(text, text.size()) == text);
  RC_ASSERT(harmless(text));
}

}  // namespace
}  // namespace slsd
