// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <span>

#include "core/exposure/tile.hpp"
#include "core/image.hpp"

namespace slsd {

/// Draws the light in a frame: three copies side by side whose tiles are coloured by the share of saturated pixels, by
/// the room's light relative to the pattern's, and by the blur of the edges relative to the pattern's period. A legend
/// below each names its four colours, from good to bad. Tiles without a pattern have no colour.
/// @param tiles  those of the frame that show the pattern, by measure_tiles()
/// @thread reentrant
[[nodiscard]] ColourImage draw_light(const GreyView& frame, std::span<const PatternedTile> tiles);

/// The colours from good to bad.
inline constexpr std::array<Rgb, 4> kLightColours{{{64, 168, 112}, {232, 200, 56}, {240, 128, 32}, {232, 40, 64}}};

}  // namespace slsd
