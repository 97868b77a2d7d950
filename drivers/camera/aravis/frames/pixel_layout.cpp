// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/pixel_layout.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace slsd {
namespace {

/// Pixel i of pixels packed bit after bit.
template <unsigned bits>
std::uint16_t lsb_pixel(const std::uint8_t* packed, std::size_t i) {
  const std::size_t bit = i * bits;
  const std::uint8_t* first = packed + bit / 8;
  const unsigned two = first[0] | static_cast<unsigned>(first[1]) << 8;  // up to 12 bits touch two bytes
  return static_cast<std::uint16_t>(two >> bit % 8 & ((1u << bits) - 1));
}

/// Pixel i of pairs in three bytes, whose low bits share the middle byte: the even pixel has its lower half.
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

constexpr std::array<PixelLayout, 24> kLayouts{{
    {"Mono8", 0x01080001, 1, false},
    {"Mono10", 0x01100003, 2, false},
    {"Mono12", 0x01100005, 2, false},
    {"Mono16", 0x01100007, 2, false},
    {"BayerGR8", 0x01080008, 1, true},
    {"BayerRG8", 0x01080009, 1, true},
    {"BayerGB8", 0x0108000a, 1, true},
    {"BayerBG8", 0x0108000b, 1, true},
    {"BayerGR10", 0x0110000c, 2, true},
    {"BayerRG10", 0x0110000d, 2, true},
    {"BayerGB10", 0x0110000e, 2, true},
    {"BayerBG10", 0x0110000f, 2, true},
    {"BayerGR12", 0x01100010, 2, true},
    {"BayerRG12", 0x01100011, 2, true},
    {"BayerGB12", 0x01100012, 2, true},
    {"BayerBG12", 0x01100013, 2, true},
    {"BayerGR16", 0x0110002e, 2, true},
    {"BayerRG16", 0x0110002f, 2, true},
    {"BayerGB16", 0x01100030, 2, true},
    {"BayerBG16", 0x01100031, 2, true},
    {"Mono10p", 0x010a0046, 2, false, PixelPacking::kLsb10},
    {"Mono12p", 0x010c0047, 2, false, PixelPacking::kLsb12},
    {"Mono10Packed", 0x010c0004, 2, false, PixelPacking::kGige10},
    {"Mono12Packed", 0x010c0006, 2, false, PixelPacking::kGige12},
}};

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

BayerPattern PixelLayout::bayer() const {
  if (name.starts_with("BayerRG")) return BayerPattern::kRggb;
  if (name.starts_with("BayerBG")) return BayerPattern::kBggr;
  if (name.starts_with("BayerGR")) return BayerPattern::kGrbg;
  return name.starts_with("BayerGB") ? BayerPattern::kGbrg : BayerPattern::kNone;
}

std::optional<PixelLayout> find_pixel_layout(std::string_view name) {
  const auto* found = std::ranges::find(kLayouts, name, &PixelLayout::name);
  if (found == kLayouts.end()) return std::nullopt;
  return *found;
}

std::string pixel_format_names() {
  std::string names;
  for (const PixelLayout& layout : kLayouts) (names += names.empty() ? "" : ", ") += layout.name;
  return names;
}

}  // namespace slsd
