// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// The storage of grey in a pixel format.
enum class GreyLayout {
  kGrey8,     ///< one byte per pixel, row by row; chroma follows the rows
  kGrey16,    ///< two bytes per pixel, little-endian
  kMosaic8,   ///< a Bayer mosaic of bytes
  kMosaic16,  ///< a Bayer mosaic of two bytes per pixel, little-endian
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

/// All formats, the best for decoding first. Grey comes before Bayer, which costs resolution; then luma, which doubles
/// the bytes on the bus; then JPEG, which costs detail.
[[nodiscard]] std::span<const PixelFormat> pixel_formats();

[[nodiscard]] std::optional<PixelFormat> find_pixel_format(std::uint32_t fourcc);

/// The number of "GREY", "Y16 " or "Y16".
[[nodiscard]] std::uint32_t fourcc_from(std::string_view name);
[[nodiscard]] std::string fourcc_name(std::uint32_t fourcc);

/// The bytes between a row's first and last pixel, inclusive; 0 for JPEG.
[[nodiscard]] std::size_t row_bytes(GreyLayout layout, int width_px);

/// The bytes of the resulting grey pixel: 1 or 2.
[[nodiscard]] int bytes_per_pixel(GreyLayout layout);

/// Tells whether frames are views of the driver's own buffers.
[[nodiscard]] bool is_zero_copy(GreyLayout layout);

/// One combination of format and size that a device offers.
struct FrameMode {
  PixelFormat format;
  int width_px = 0;
  int height_px = 0;

  friend bool operator==(const FrameMode&, const FrameMode&) = default;
};

/// The layout of a frame in a buffer.
struct FrameLayout {
  FrameMode mode;
  std::size_t stride_bytes = 0;
  /// The size of a whole frame in bytes; a smaller one is torn. 1 for JPEG.
  std::size_t bytes_min = 0;
};

/// Tells whether planes of chroma follow the rows of grey: NV12 and YUV420.
[[nodiscard]] bool has_chroma_planes(std::uint32_t fourcc);

/// The places of chroma in such a frame, in bytes.
struct ChromaPlanes {
  explicit ChromaPlanes(const FrameLayout& layout);
  std::size_t blue, red;     ///< the first Cb and Cr
  std::size_t step_bytes;    ///< from one Cb to the next of its row
  std::size_t stride_bytes;  ///< from one row to the next
  std::size_t end;           ///< after the last byte
};

/// "GREY 1600x1200".
[[nodiscard]] std::string to_string(const FrameMode& mode);

/// The device's modes that slsd can decode. A range of sizes gives the smallest, the largest, and the wanted size if it
/// lies within.
[[nodiscard]] std::vector<FrameMode> list_modes(const V4l2Device& device, const V4l2CameraOptions& options);

/// Chooses the best mode for decoding that fits the options: first by the order of pixel_formats(), then the largest.
/// @errors kUnsupported, with the list of available modes
[[nodiscard]] Result<FrameMode> choose_mode(const std::vector<FrameMode>& modes, const V4l2CameraOptions& options);

/// Sets the mode and reads back the device's choice.
/// @errors kMismatch if the device chose another; kBusy, kDisconnected, kIo
[[nodiscard]] Result<FrameLayout> set_mode(const V4l2Device& device, const FrameMode& mode);

}  // namespace slsd
