// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/frames/pack_pixels.hpp"

#include <cstddef>
#include <cstring>

namespace slsd::test {
namespace {

constexpr std::uint32_t kMono10p = 0x010a0046;
constexpr std::uint32_t kMono12p = 0x010c0047;
constexpr std::uint32_t kMono10Packed = 0x010c0004;
constexpr std::uint32_t kMono12Packed = 0x010c0006;

std::vector<std::uint16_t> whole(const std::vector<std::uint8_t>& pixels) {
  std::vector<std::uint16_t> values(pixels.size() / 2);
  std::memcpy(values.data(), pixels.data(), values.size() * 2);
  return values;
}

// One long number, of which the lowest byte comes first.
void pack_bit_after_bit(int bits, std::vector<std::uint8_t>& pixels) {
  std::uint32_t waiting = 0;
  int count = 0;
  std::vector<std::uint8_t> packed;
  for (const std::uint32_t value : whole(pixels)) {
    waiting |= value << count;
    for (count += bits; count >= 8; count -= 8, waiting >>= 8) packed.push_back(static_cast<std::uint8_t>(waiting));
  }
  if (count > 0) packed.push_back(static_cast<std::uint8_t>(waiting));
  pixels = packed;
}

void pack_by_twos(int bits, std::vector<std::uint8_t>& pixels) {
  const std::vector<std::uint16_t> values = whole(pixels);
  const int low = bits - 8;
  std::vector<std::uint8_t> packed;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    packed.push_back(static_cast<std::uint8_t>(values[i] >> low));
    const int lows = (values[i] & ((1 << low) - 1)) | (values[i + 1] & ((1 << low) - 1)) << 4;
    packed.push_back(static_cast<std::uint8_t>(lows));
    packed.push_back(static_cast<std::uint8_t>(values[i + 1] >> low));
  }
  pixels = packed;
}

}  // namespace

int used_bits(std::uint32_t pixel_format) {
  switch (pixel_format) {
    case 0x01100003:
    case kMono10p:
    case kMono10Packed:
      return 10;
    case 0x01100005:
    case 0x01100011:
    case kMono12p:
    case kMono12Packed:
      return 12;
    case 0x01100007:
      return 16;
    default:
      return 8;
  }
}

void pack_pixels(std::uint32_t pixel_format, std::vector<std::uint8_t>& pixels) {
  if (pixel_format == kMono10p) return pack_bit_after_bit(10, pixels);
  if (pixel_format == kMono12p) return pack_bit_after_bit(12, pixels);
  if (pixel_format == kMono10Packed) return pack_by_twos(10, pixels);
  if (pixel_format == kMono12Packed) return pack_by_twos(12, pixels);
}

}  // namespace slsd::test
