// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/edid.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>

namespace slsd {
namespace {

constexpr std::size_t kBlockBytes = 128;
constexpr std::uint8_t kHeader[] = {0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x00};
constexpr std::uint8_t kSerialText = 0xFF;
constexpr std::uint8_t kNameText = 0xFC;

// The text of the descriptor with this tag; empty if there is none.
std::string descriptor_text(std::span<const std::uint8_t> block, std::uint8_t tag) {
  for (const std::size_t start : {54U, 72U, 90U, 108U}) {
    if (block[start] != 0 || block[start + 1] != 0 || block[start + 2] != 0 || block[start + 3] != tag) continue;
    std::string text;
    for (const std::uint8_t letter : block.subspan(start + 5, 13)) {
      if (letter == '\n') break;
      if (std::isprint(letter) != 0) text += static_cast<char>(letter);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }
  return {};
}

// Three letters of five bits each, then a number.
std::string maker_and_product(std::span<const std::uint8_t> block) {
  const unsigned letters = block[8] << 8U | block[9];
  const unsigned product = block[10] | block[11] << 8U;
  char text[16];
  std::snprintf(text, sizeof text, "%c%c%c %04X", static_cast<char>('@' + (letters >> 10U & 31U)),
                static_cast<char>('@' + (letters >> 5U & 31U)), static_cast<char>('@' + (letters & 31U)), product);
  return text;
}

}  // namespace

EdidIdentity read_edid(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kBlockBytes || !std::equal(std::begin(kHeader), std::end(kHeader), bytes.begin())) return {};
  const auto block = bytes.first(kBlockBytes);
  EdidIdentity identity{descriptor_text(block, kNameText), descriptor_text(block, kSerialText)};
  if (identity.model.empty()) identity.model = maker_and_product(block);
  const std::uint32_t number = block[12] | block[13] << 8U | block[14] << 16U | std::uint32_t{block[15]} << 24U;
  if (identity.serial.empty() && number != 0) identity.serial = std::to_string(number);
  return identity;
}

}  // namespace slsd
