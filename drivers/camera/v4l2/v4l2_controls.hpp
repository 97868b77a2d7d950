// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>

#include "core/result.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// The device's exposure times, read back after all settings.
struct ExposureTiming {
  std::optional<std::chrono::nanoseconds> exposure;  ///< empty if the device has no such control, or sets it itself
  std::optional<std::chrono::nanoseconds> period;    ///< time from frame to frame; empty if unknown
};

/// Turns automatic functions off, sets the options, and verifies the device's values. Uses EXPOSURE_ABSOLUTE (units of
/// 100 us), GAIN or ANALOGUE_GAIN, FOCUS_ABSOLUTE, POWER_LINE_FREQUENCY.
/// @errors kUnsupported (no such control), kInvalidArgument (out of range), kMismatch (the device did not take the
///         value), kDisconnected, kIo; each names the control
[[nodiscard]] Result<> set_controls(const V4l2Device& device, const V4l2CameraOptions& options);

/// Sets the exposure, also while the device streams, and verifies the device's value. @errors as set_controls()
[[nodiscard]] Result<> set_exposure(const V4l2Device& device, double exposure_us);

/// Sets the frame rate if the options name one, and verifies it.
/// @errors kUnsupported (the device has no such setting), kMismatch (it chose another), kDisconnected, kIo
[[nodiscard]] Result<> set_frame_rate(const V4l2Device& device, const V4l2CameraOptions& options);

[[nodiscard]] ExposureTiming read_timing(const V4l2Device& device);

}  // namespace slsd
