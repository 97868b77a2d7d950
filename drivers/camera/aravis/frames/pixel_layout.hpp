// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/image.hpp"
#include "drivers/files/bayer.hpp"

namespace slsd {

/// The packing of pixels of 10 or 12 bits into bytes. Rows follow each other without padding.
enum class PixelPacking {
  kNone,    ///< one or two whole bytes per pixel
  kLsb10,   ///< "Mono10p": bits in sequence, lowest first
  kLsb12,   ///< "Mono12p"
  kGige10,  ///< "Mono10Packed": two pixels in 3 bytes, whose low bits share the middle byte
  kGige12,  ///< "Mono12Packed"
};

/// The size of this many packed pixels in a row, in bytes, rounded up.
[[nodiscard]] constexpr std::size_t packed_bytes(std::size_t pixels, int bits_per_pixel) {
  return (pixels * static_cast<std::size_t>(bits_per_pixel) + 7) / 8;
}

/// Unpacks pixels into whole words, with values from the lowest bit on.
/// @param packed   at least packed_bytes() of the image's pixels
/// @param packing  any but kNone
/// @param pixels   output
/// @thread reentrant
void unpack_pixels(std::span<const std::uint8_t> packed, PixelPacking packing, Grey16& pixels);

/// The memory layout of a camera's pixels: whole bytes, little-endian, values from the lowest bit on; or packed.
struct PixelLayout {
  std::string_view name;    ///< name in the Pixel Format Naming Convention
  std::uint32_t code = 0;   ///< code in GigE Vision and USB3 Vision
  int bytes_per_pixel = 1;  ///< 1 or 2; for packed pixels, after unpacking
  bool mosaic = false;      ///< a Bayer mosaic, which is converted to grey
  PixelPacking packing = PixelPacking::kNone;

  /// The pattern of a mosaic, by its name: "BayerRG8" begins with red and green.
  [[nodiscard]] BayerPattern bayer() const;
  /// The bits of a pixel during transfer.
  [[nodiscard]] int bits_per_pixel() const { return static_cast<int>(code >> 16 & 0xff); }
  /// Tells whether frames are views of the stream's own buffers.
  [[nodiscard]] bool is_zero_copy() const { return !mosaic && packing == PixelPacking::kNone; }

  friend bool operator==(const PixelLayout&, const PixelLayout&) = default;
};

/// The layout of a pixel format that this driver reads; nothing for others, such as packed mosaics.
/// @thread reentrant
[[nodiscard]] std::optional<PixelLayout> find_pixel_layout(std::string_view name);

/// The names of the pixel formats, separated by commas.
[[nodiscard]] std::string pixel_format_names();

}  // namespace slsd
