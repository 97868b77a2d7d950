// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>

#include "core/result.hpp"

namespace slsd {

/// Largest side of an image that can be decoded: the ends of its runs have 16 bits.
inline constexpr int kMaxImageSidePx = 32767;
/// Largest number of pixels: the largest sensors have 250 million, and two decoding lanes of that size still fit in
/// memory.
inline constexpr std::int64_t kMaxImagePx = std::int64_t{1} << 28;

[[nodiscard]] constexpr bool is_readable_size(int width_px, int height_px) {
  return width_px > 0 && height_px > 0 && width_px <= kMaxImageSidePx && height_px <= kMaxImageSidePx &&
         std::int64_t{width_px} * height_px <= kMaxImagePx;
}

/// "1600x1200". @thread reentrant
[[nodiscard]] inline std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

/// @errors kUnsupported: the decoder cannot read images of this size
/// @thread reentrant
[[nodiscard]] inline Result<> check_image_size(int width_px, int height_px) {
  if (is_readable_size(width_px, height_px)) return {};
  return fail(ErrorCode::kUnsupported, "images of " + size_text(width_px, height_px) +
                                           " pixels cannot be decoded: 1 to " + std::to_string(kMaxImageSidePx) +
                                           " to a side and at most " + std::to_string(kMaxImagePx) +
                                           " altogether; have the camera bin or crop them");
}

}  // namespace slsd
