// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// How a camera's pixels lie in memory: whole bytes, little-endian, used from the lowest bit on.
struct PixelLayout {
  std::string_view name;    ///< by the Pixel Format Naming Convention
  std::uint32_t code = 0;   ///< of GigE Vision and USB3 Vision
  int bytes_per_pixel = 1;  ///< 1 or 2
  bool mosaic = false;      ///< a Bayer mosaic, to be turned into grey

  friend bool operator==(const PixelLayout&, const PixelLayout&) = default;
};

/// The layout of a pixel format that this driver reads; nothing for another, such as a packed one.
/// @thread reentrant
[[nodiscard]] std::optional<PixelLayout> find_pixel_layout(std::string_view name);

/// Their names, with commas.
[[nodiscard]] std::string pixel_format_names();

}  // namespace slsd
