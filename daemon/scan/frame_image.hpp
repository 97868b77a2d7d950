// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/code/pattern.hpp"
#include "core/decode/decoding.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/scan/scan_result.hpp"
#include "drivers/camera/frame.hpp"
#include "picture/draw_decoding.hpp"

namespace slsd {

/// A frame as a PNG of its own depth. @errors of encode_png() @thread reentrant
[[nodiscard]] Result<FrameImage> png_of(const Frame& frame);

/// A frame's pixels row by row, 16 bits little-endian. @thread reentrant
[[nodiscard]] Result<FrameImage> raw_of(const Frame& frame);
/// The same into an image whose memory may do. @thread reentrant
void copy_raw(const Frame& frame, FrameImage& image);
/// The pixels of an image that is raw. It has to outlive them.
[[nodiscard]] GreyView view_of(const FrameImage& image);

/// A frame as it is to be kept. @param coding  not kNone @errors of encode_png() @thread reentrant
[[nodiscard]] Result<FrameImage> image_of(const Frame& frame, FrameCoding coding, std::string camera);

/// Draws what was decoded into the frame, as a PNG. @errors of encode_png() @thread reentrant
[[nodiscard]] Result<std::string> picture_of(const GreyView& image, const Decoding& decoding, const Pattern& pattern,
                                             DecodingLook look);

}  // namespace slsd
