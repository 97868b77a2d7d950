// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/printable.hpp"

#include <array>
#include <cstdint>
#include <cstdio>

namespace slsd {
namespace {

constexpr std::string_view kEllipsis = "\u2026";

struct Character {
  char32_t code;     ///< code point; for a byte that is not UTF-8, that byte
  std::size_t size;  ///< size in bytes
  bool valid;
};

bool continues(char byte) {
  return (static_cast<std::uint8_t>(byte) & 0xC0U) == 0x80U;
}

// Decodes the first character. Overlong forms, surrogates and values above U+10FFFF are not UTF-8 (RFC 3629, section
// 3).
Character decode(std::string_view text) {
  const auto first = static_cast<std::uint8_t>(text.front());
  const Character no_utf8{first, 1, false};
  if (first < 0x80) return {first, 1, true};
  const std::size_t size = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < size) return no_utf8;
  char32_t code = first & (0xFFU >> (size + 1));
  for (const char byte : text.substr(1, size - 1)) {
    if (!continues(byte)) return no_utf8;
    code = code << 6U | (static_cast<std::uint8_t>(byte) & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[size] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return no_utf8;
  return {code, size, true};
}

bool within(char32_t code, char32_t low, char32_t high) {
  return code >= low && code <= high;
}

// Characters that control a terminal, end a line, or disguise the text. Joiners (U+200C, U+200D) belong to words.
bool obeyed(char32_t code) {
  return code < 0x20 || within(code, 0x7F, 0x9F) || code == 0x061C || code == 0x200B || within(code, 0x200E, 0x200F) ||
         within(code, 0x2028, 0x202E) || within(code, 0x2060, 0x206F) || code == 0xFEFF ||
         within(code, 0xFFF9, 0xFFFB) || within(code, 0xE0000, 0xE007F);
}

std::string escape(const Character& character) {
  if (character.code == '\n') return "\\n";
  if (character.code == '\r') return "\\r";
  if (character.code == '\t') return "\\t";
  std::array<char, 12> text{};
  const char* format = character.code < 0x100 && (character.code < 0x80 || !character.valid) ? "\\x%02x" : "\\u%04x";
  std::snprintf(text.data(), text.size(), format, static_cast<unsigned>(character.code));
  return text.data();
}

}  // namespace

std::string printable(std::string_view foreign, std::size_t limit_bytes) {
  std::string text;
  std::size_t before_ellipsis = 0;  // length of the text that leaves room for an ellipsis
  while (!foreign.empty()) {
    const Character character = decode(foreign);
    const bool plain = character.valid && !obeyed(character.code);
    text += plain ? std::string(foreign.substr(0, character.size)) : escape(character);
    if (text.size() > limit_bytes) {
      text.resize(before_ellipsis);
      return limit_bytes < kEllipsis.size() ? text : text.append(kEllipsis);
    }
    if (text.size() + kEllipsis.size() <= limit_bytes) before_ellipsis = text.size();
    foreign.remove_prefix(character.size);
  }
  return text;
}

}  // namespace slsd
