// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>

#include "core/result.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// The device's exposure times, read back after everything was set.
struct ExposureTiming {
  std::optional<std::chrono::nanoseconds> exposure;  ///< nothing where it has no such control, or sets it by itself
  std::optional<std::chrono::nanoseconds> period;    ///< time from frame to frame; empty if it does not tell
};

/// Turns everything automatic off, then sets what the options name, and compares what the device took: V4L2's
/// EXPOSURE_ABSOLUTE (units of 100 us), GAIN or ANALOGUE_GAIN, FOCUS_ABSOLUTE, POWER_LINE_FREQUENCY.
/// @errors kUnsupported (it has no such control), kInvalidArgument (out of its range), kMismatch (it did not take the
///         value), kDisconnected, kIo; each names the control
[[nodiscard]] Result<> set_controls(const V4l2Device& device, const V4l2CameraOptions& options);

/// Sets the frame rate, where the options name one, and compares.
/// @errors kUnsupported (it cannot), kMismatch (it has another), kDisconnected, kIo
[[nodiscard]] Result<> set_frame_rate(const V4l2Device& device, const V4l2CameraOptions& options);

[[nodiscard]] ExposureTiming read_timing(const V4l2Device& device);

}  // namespace slsd
