// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/pixel_layout.hpp"

#include <algorithm>
#include <array>

namespace slsd {
namespace {

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
