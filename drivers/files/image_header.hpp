// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// What an image file says of itself.
struct ImageHeader {
  std::uint64_t width_px = 0;
  std::uint64_t height_px = 0;
  int channels = 1;           ///< as decoded: 1, 3 or 4
  int bytes_per_channel = 1;  ///< as decoded: 1 or 2

  /// No overflow: neither side has more than 32 bits.
  [[nodiscard]] double decoded_bytes() const {
    return static_cast<double>(width_px) * static_cast<double>(height_px) * channels * bytes_per_channel;
  }
};

/// Reads the header of a PNG, TIFF, PGM, PPM or BMP file, told apart by their first bytes, and checks what the library
/// that decodes them does not: that the file is whole, so that no part of the image is made up, and that it is of a
/// kind which is decoded faithfully.
/// @errors kMalformed, kUnsupported; without a place, which the caller knows
/// @thread reentrant
[[nodiscard]] Result<ImageHeader> read_image_header(std::string_view bytes);

/// One format each; the bytes begin as that format does. @thread reentrant
[[nodiscard]] Result<ImageHeader> read_png_header(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> read_tiff_header(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> read_pnm_header(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> read_bmp_header(std::string_view bytes);

/// "the file ends early, or is damaged; ...": the same words for every format. @thread reentrant
[[nodiscard]] tl::unexpected<Error> fail_truncated(std::string_view format);
[[nodiscard]] tl::unexpected<Error> fail_variant(std::string_view format, std::string_view what);

}  // namespace slsd
