// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/colour.hpp"
#include "core/image.hpp"

namespace slsd {

/// The colours of a mosaic's first two pixels in its first two rows.
enum class BayerPattern { kNone, kRggb, kBggr, kGrbg, kGbrg };

/// Parses "none", "RGGB", "BGGR", "GRBG" or "GBRG", the words of the configuration.
[[nodiscard]] std::optional<BayerPattern> parse_bayer_pattern(std::string_view name);
[[nodiscard]] std::string_view to_string(BayerPattern pattern);

/// Converts a Bayer mosaic into grey, (R + 2 G + B) / 4 at every pixel: filters the mosaic with the binomial kernel
///
///     1 2 1
///     2 4 2   / 16,
///     1 2 1
///
/// which is zero at the frequencies (pi, 0), (0, pi) and (pi, pi) of a mosaic's colour differences, and so keeps only
/// its luminance (Alleysson, Suesstrunk, Herault 2005, "Linear demosaicing inspired by the human visual system"). The
/// kernel is symmetric and the same at every pixel, so a symbol's centre does not depend on its position in the mosaic.
/// It would if missing colours were interpolated first. One kernel suits all four patterns. Mirroring at the image's
/// edges keeps the colours aligned. Width and height are at least 2.
/// @thread reentrant
[[nodiscard]] Grey8 grey_from_mosaic(const Grey8& mosaic);
[[nodiscard]] Grey16 grey_from_mosaic(const Grey16& mosaic);

/// The colours of a mosaic, by the same kernel: each is the mean of its pixels within the kernel, by their weights. So
/// the grey is (R + 2 G + B) / 4 of them, up to rounding.
/// @param mosaic   at least 2x2 pixels
/// @param pattern  not kNone
/// @thread reentrant
[[nodiscard]] ColourFrame colours_from_mosaic(const GreyView& mosaic, BayerPattern pattern);

/// Converts into an existing image, without an allocation.
/// @param grey  in the mosaic's size
/// @param sums  room for one number per column
void grey_from_mosaic(const ImageView<std::uint8_t>& mosaic, Grey8& grey, std::span<std::uint32_t> sums);
void grey_from_mosaic(const ImageView<std::uint16_t>& mosaic, Grey16& grey, std::span<std::uint32_t> sums);

}  // namespace slsd
