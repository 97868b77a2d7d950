// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/camera/v4l2/frame_layout.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// Converts buffers of other formats into grey images: luma of YUYV and UYVY, Bayer, and MJPG like the file camera.
/// Only MJPG allocates memory after construction.
/// @thread thread-bound
class GreyConverter {
 public:
  explicit GreyConverter(const FrameLayout& layout);

  /// The frame's grey, valid until the next call.
  /// @param bytes  of a whole frame
  /// @errors kFrameTorn: a JPEG image that is damaged, cut short or of another size; kUnsupported: a rare kind of JPEG
  [[nodiscard]] Result<GreyView> convert(std::span<std::byte> bytes);

 private:
  [[nodiscard]] Result<GreyView> convert_jpeg(std::span<const std::byte> bytes);
  [[nodiscard]] GreyView take_luma(std::span<const std::byte> bytes, std::size_t first);

  FrameLayout layout_;
  GreyImage grey_;
  std::vector<std::uint32_t> columns_;
};

/// A view of a buffer that holds a Bayer mosaic.
[[nodiscard]] GreyView mosaic_view_of(std::span<const std::byte> bytes, const FrameLayout& layout);

/// A view of a buffer that holds a grey image. @param bytes  aligned to two
[[nodiscard]] GreyView view_of(std::span<const std::byte> bytes, const FrameLayout& layout);

}  // namespace slsd
