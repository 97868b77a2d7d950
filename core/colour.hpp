// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/image.hpp"

namespace slsd {

/// Levels of red, green and blue, on the scale of the grey levels of the same frame.
using ColourLevels = std::array<std::uint16_t, 3>;
using ColourFrame = Image<ColourLevels>;

/// Factors of red, green and blue that make a white surface under the projector's white grey: the white balance.
using ColourGains = std::array<double, 3>;

[[nodiscard]] constexpr Rgb grey_of(std::uint8_t level) {
  return {level, level, level};
}

/// A colour in one number: 0, red, green and blue from its highest byte, as PCL packs it.
[[nodiscard]] constexpr std::uint32_t packed(const Rgb& colour) {
  return std::uint32_t{colour[0]} << 16 | std::uint32_t{colour[1]} << 8 | colour[2];
}
[[nodiscard]] constexpr Rgb unpacked(std::uint32_t colour) {
  return {static_cast<std::uint8_t>(colour >> 16), static_cast<std::uint8_t>(colour >> 8),
          static_cast<std::uint8_t>(colour)};
}

}  // namespace slsd
