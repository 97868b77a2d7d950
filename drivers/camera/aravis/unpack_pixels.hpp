// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/image.hpp"

namespace slsd {

/// How pixels of 10 or 12 bits lie in bytes. Rows follow each other without padding.
enum class PixelPacking {
  kNone,    ///< in 1 or 2 bytes of their own
  kLsb10,   ///< "Mono10p": bit after bit, the lowest first
  kLsb12,   ///< "Mono12p"
  kGige10,  ///< "Mono10Packed": two pixels in 3 bytes, the low bits of both in the middle one
  kGige12,  ///< "Mono12Packed"
};

/// Of so many pixels in a row, rounded up.
[[nodiscard]] constexpr std::size_t packed_bytes(std::size_t pixels, int bits_per_pixel) {
  return (pixels * static_cast<std::size_t>(bits_per_pixel) + 7) / 8;
}

/// Turns packed pixels into whole ones, used from the lowest bit on.
/// @param packed   at least packed_bytes() of the image's pixels
/// @param packing  any but kNone
/// @param pixels   filled
/// @thread reentrant
void unpack_pixels(std::span<const std::uint8_t> packed, PixelPacking packing, Grey16& pixels);

}  // namespace slsd
