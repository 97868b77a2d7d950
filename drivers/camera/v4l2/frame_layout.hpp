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

/// The way in which a pixel format holds its grey.
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

/// The bytes from a row's first to its last pixel; 0 for JPEG.
[[nodiscard]] std::size_t row_bytes(GreyLayout layout, int width_px);

/// The bytes of a grey pixel that it becomes: 1 or 2.
[[nodiscard]] int bytes_per_pixel(GreyLayout layout);

/// Frames are views of the driver's own buffers.
[[nodiscard]] bool is_zero_copy(GreyLayout layout);

/// One way in which a device can deliver frames.
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
  /// The least number of bytes of a whole frame; fewer are a torn one. For JPEG one.
  std::size_t bytes_min = 0;
};

/// "GREY 1600x1200".
[[nodiscard]] std::string to_string(const FrameMode& mode);

/// The device's modes that can be decoded. A range of sizes gives the smallest and the largest, and the wanted size if
/// it lies within.
[[nodiscard]] std::vector<FrameMode> list_modes(const V4l2Device& device, const V4l2CameraOptions& options);

/// The best for decoding of those that fit the options: the order of pixel_formats(), then the largest.
/// @errors kUnsupported, with the list of what there is
[[nodiscard]] Result<FrameMode> choose_mode(const std::vector<FrameMode>& modes, const V4l2CameraOptions& options);

/// Sets the mode and reads back what the device made of it.
/// @errors kMismatch where that is something else; kBusy, kDisconnected, kIo
[[nodiscard]] Result<FrameLayout> set_mode(const V4l2Device& device, const FrameMode& mode);

}  // namespace slsd
