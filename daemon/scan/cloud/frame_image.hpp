// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/code/pattern.hpp"
#include "core/decode/decoding.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "drivers/camera/frame.hpp"
#include "picture/draw_decoding.hpp"

namespace slsd {

/// A frame as a PNG of the same bit depth. @errors of encode_png() @thread reentrant
[[nodiscard]] Result<FrameImage> png_of(const Frame& frame);

/// A frame's pixels row by row, 16 bits little-endian. @thread reentrant
[[nodiscard]] Result<FrameImage> raw_of(const Frame& frame);
/// Copies the frame's raw pixels into an image and reuses its memory if possible. @thread reentrant
void copy_raw(const Frame& frame, FrameImage& image);
/// A view of a raw image's pixels. The image must outlive it.
[[nodiscard]] GreyView view_of(const FrameImage& image);

/// A frame in the coding for keeping. @param coding  not kNone @errors of encode_png() @thread reentrant
[[nodiscard]] Result<FrameImage> image_of(const Frame& frame, FrameCoding coding, std::string camera);

/// Draws the decoded symbols into the frame, as a PNG. @errors of encode_png() @thread reentrant
[[nodiscard]] Result<std::string> picture_of(const GreyView& image, const Decoding& decoding, const Pattern& pattern,
                                             DecodingLook look);

}  // namespace slsd
