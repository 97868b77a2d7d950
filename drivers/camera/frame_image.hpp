// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>

#include "core/image.hpp"
#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The coding of frames that are kept.
enum class FrameCoding { kNone, kRaw, kPng };

/// One camera's image as it arrived.
struct FrameImage {
  std::string bytes;  ///< a PNG, or pixels row by row, 16 bits little-endian
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  std::uint64_t sequence = 0;
  std::string camera = {};  ///< the camera's name; the times are the Frame's
  Picture light = Picture::kPattern;
  MonotonicTime exposure_start = {};
  MonotonicTime received = {};
};

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

}  // namespace slsd
