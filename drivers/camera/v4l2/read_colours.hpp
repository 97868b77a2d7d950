// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "core/colour.hpp"
#include "core/result.hpp"
#include "drivers/camera/v4l2/frame_layout.hpp"

namespace slsd {

/// Copies a frame for a later conversion into colours: of a Bayer mosaic, of YUYV, UYVY, NV12 and YUV420 (ITU-R
/// BT.601 with the limited range, V4L2's default for them), or of JPEG. Empty for other formats.
/// @param bytes  of a whole frame
/// @thread reentrant; another thread may convert
[[nodiscard]] std::function<Result<ColourFrame>()> colours_later(std::span<const std::byte> bytes,
                                                                 const FrameLayout& layout);

}  // namespace slsd
