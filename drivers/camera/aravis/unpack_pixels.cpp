// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/unpack_pixels.hpp"

#include <cassert>

namespace slsd {
namespace {

/// Pixel i of those that lie bit after bit.
template <unsigned bits>
std::uint16_t lsb_pixel(const std::uint8_t* packed, std::size_t i) {
  const std::size_t bit = i * bits;
  const std::uint8_t* first = packed + bit / 8;
  const unsigned two = first[0] | static_cast<unsigned>(first[1]) << 8;  // up to 12 bits touch two bytes
  return static_cast<std::uint16_t>(two >> bit % 8 & ((1u << bits) - 1));
}

/// Pixel i of those whose low bits share the middle one of three bytes: the even one has the lower half of it.
template <unsigned bits>
std::uint16_t gige_pixel(const std::uint8_t* packed, std::size_t i) {
  constexpr unsigned kLow = bits - 8;
  const std::uint8_t* three = packed + i / 2 * 3;
  const unsigned high = i % 2 == 0 ? three[0] : three[2];
  const unsigned low = i % 2 == 0 ? three[1] : three[1] >> 4u;
  return static_cast<std::uint16_t>(high << kLow | (low & ((1u << kLow) - 1)));
}

template <class Pixel>
void fill(const std::uint8_t* packed, Grey16& pixels, Pixel pixel) {
  std::size_t i = 0;
  for (int y = 0; y < pixels.height(); ++y) {
    std::uint16_t* row = pixels.row(y);
    for (int x = 0; x < pixels.width(); ++x, ++i) row[x] = pixel(packed, i);
  }
}

}  // namespace

void unpack_pixels(std::span<const std::uint8_t> packed, PixelPacking packing, Grey16& pixels) {
  const std::uint8_t* bytes = packed.data();
  switch (packing) {
    case PixelPacking::kLsb10:
      return fill(bytes, pixels, lsb_pixel<10>);
    case PixelPacking::kLsb12:
      return fill(bytes, pixels, lsb_pixel<12>);
    case PixelPacking::kGige10:
      return fill(bytes, pixels, gige_pixel<10>);
    case PixelPacking::kGige12:
      return fill(bytes, pixels, gige_pixel<12>);
    case PixelPacking::kNone:
      assert(false);
  }
}

}  // namespace slsd
