// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace slsd {

/// How a pixel format holds its grey.
enum class GreyLayout {
  kGrey8,     ///< a byte a pixel, row by row; what follows the rows is chroma
  kGrey16,    ///< two bytes a pixel, little-endian
  kMosaic8,   ///< a Bayer mosaic of bytes
  kMosaic16,  ///< a Bayer mosaic of two bytes a pixel, little-endian
  kYuyv,      ///< luma in the even bytes
  kUyvy,      ///< luma in the odd bytes
  kJpeg       ///< a JPEG image
};

/// A pixel format of V4L2 that can be decoded.
struct PixelFormat {
  std::uint32_t fourcc = 0;
  GreyLayout layout = GreyLayout::kGrey8;

  friend bool operator==(const PixelFormat&, const PixelFormat&) = default;
};

/// All of them, the best for decoding first: grey before Bayer, which costs resolution, before luma, which costs the
/// bus twice the bytes, before JPEG, which costs detail.
[[nodiscard]] std::span<const PixelFormat> pixel_formats();

[[nodiscard]] std::optional<PixelFormat> find_pixel_format(std::uint32_t fourcc);

/// The number of "GREY", "Y16 " or "Y16".
[[nodiscard]] std::uint32_t fourcc_from(std::string_view name);
[[nodiscard]] std::string fourcc_name(std::uint32_t fourcc);

/// Of a row's first to its last pixel; 0 for JPEG.
[[nodiscard]] std::size_t row_bytes(GreyLayout layout, int width_px);

/// Of the grey that it becomes: 1 or 2.
[[nodiscard]] int bytes_per_pixel(GreyLayout layout);

/// Frames are views of the driver's own buffers.
[[nodiscard]] bool is_zero_copy(GreyLayout layout);

}  // namespace slsd
