// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/camera/aravis/unpack_pixels.hpp"

namespace slsd {

/// How a camera's pixels lie in memory: whole bytes, little-endian, used from the lowest bit on, or packed.
struct PixelLayout {
  std::string_view name;    ///< by the Pixel Format Naming Convention
  std::uint32_t code = 0;   ///< of GigE Vision and USB3 Vision
  int bytes_per_pixel = 1;  ///< 1 or 2; of packed ones, when they are unpacked
  bool mosaic = false;      ///< a Bayer mosaic, to be turned into grey
  PixelPacking packing = PixelPacking::kNone;

  /// On the wire.
  [[nodiscard]] int bits_per_pixel() const { return static_cast<int>(code >> 16 & 0xff); }
  /// Frames are views of the stream's own buffers.
  [[nodiscard]] bool is_zero_copy() const { return !mosaic && packing == PixelPacking::kNone; }

  friend bool operator==(const PixelLayout&, const PixelLayout&) = default;
};

/// The layout of a pixel format that this driver reads; nothing for another, such as a packed mosaic.
/// @thread reentrant
[[nodiscard]] std::optional<PixelLayout> find_pixel_layout(std::string_view name);

/// Their names, with commas.
[[nodiscard]] std::string pixel_format_names();

}  // namespace slsd
