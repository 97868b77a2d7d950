// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/v4l2/pixel_format.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// One way in which a device can deliver frames.
struct FrameMode {
  PixelFormat format;
  int width_px = 0;
  int height_px = 0;

  friend bool operator==(const FrameMode&, const FrameMode&) = default;
};

/// How a frame lies in a buffer.
struct FrameLayout {
  FrameMode mode;
  std::size_t stride_bytes = 0;
  /// Of a whole frame at least; fewer are a torn one. For JPEG one.
  std::size_t bytes_min = 0;
};

/// "GREY 1600x1200".
[[nodiscard]] std::string to_string(const FrameMode& mode);

/// What the device offers of what can be decoded; of a range of sizes the smallest and the largest, and the one asked
/// for where it lies within.
[[nodiscard]] std::vector<FrameMode> list_modes(const V4l2Device& device, const V4l2CameraOptions& options);

/// The best for decoding of those that fit the options: the order of pixel_formats(), then the largest.
/// @errors kUnsupported, with the list of what there is
[[nodiscard]] Result<FrameMode> choose_mode(const std::vector<FrameMode>& modes, const V4l2CameraOptions& options);

/// Sets the mode and reads back what the device made of it.
/// @errors kMismatch where that is something else; kBusy, kDisconnected, kIo
[[nodiscard]] Result<FrameLayout> set_mode(const V4l2Device& device, const FrameMode& mode);

}  // namespace slsd
