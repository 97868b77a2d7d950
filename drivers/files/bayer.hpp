// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/image.hpp"

namespace slsd {

/// The colours of a mosaic's first two pixels in its first two rows.
enum class BayerPattern { kNone, kRggb, kBggr, kGrbg, kGbrg };

/// "none", "RGGB", "BGGR", "GRBG" or "GBRG", as the configuration writes it.
[[nodiscard]] std::optional<BayerPattern> parse_bayer_pattern(std::string_view name);
[[nodiscard]] std::string_view to_string(BayerPattern pattern);

/// Turns a Bayer mosaic into grey, (R + 2 G + B) / 4 at every pixel: the mosaic through the binomial kernel
///
///     1 2 1
///     2 4 2   / 16,
///     1 2 1
///
/// which is zero at the frequencies (pi, 0), (0, pi) and (pi, pi) where the colour differences of a mosaic live, and so
/// leaves its luminance (Alleysson, Suesstrunk, Herault 2005, "Linear demosaicing inspired by the human visual
/// system"). It is the same symmetric kernel at every pixel, so that a symbol's centre does not move with its position
/// in the mosaic, as it does when missing colours are interpolated first. It is the same for all four patterns.
/// The image's edges are mirrored, which keeps the colours in step. Width and height are at least 2.
/// @thread reentrant
[[nodiscard]] Grey8 grey_from_mosaic(const Grey8& mosaic);
[[nodiscard]] Grey16 grey_from_mosaic(const Grey16& mosaic);

/// The same into an image that there is, without an allocation.
/// @param grey  of the mosaic's size
/// @param sums  room for a number to a column
void grey_from_mosaic(const ImageView<std::uint8_t>& mosaic, Grey8& grey, std::span<std::uint32_t> sums);
void grey_from_mosaic(const ImageView<std::uint16_t>& mosaic, Grey16& grey, std::span<std::uint32_t> sums);

}  // namespace slsd
