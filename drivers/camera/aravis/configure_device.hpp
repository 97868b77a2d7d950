// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device_features.hpp"
#include "drivers/camera/aravis/pixel_layout.hpp"

namespace slsd {

/// The frames of a camera as it is configured.
struct DeviceLayout {
  int width_px = 0;
  int height_px = 0;
  PixelLayout pixels;
  std::chrono::nanoseconds period{0};  ///< of frames, where the camera runs freely

  [[nodiscard]] std::size_t bytes() const {
    return packed_bytes(static_cast<std::size_t>(width_px) * height_px, pixels.bits_per_pixel());
  }
};

/// Sets region, pixel format, exposure and gain, turns everything automatic off, and compares what the camera took.
/// @errors kUnsupported, kMismatch, kDisconnected
[[nodiscard]] Result<DeviceLayout> configure_image(const DeviceFeatures& features, const AravisCameraOptions& options);

/// Lets the camera's clock follow the network's where the options say so, and go by itself where they do not.
/// @errors kUnsupported: the camera has no PTP; as configure_image()
[[nodiscard]] Result<> configure_clock(const DeviceFeatures& features, const AravisCameraOptions& options);

/// Sets what the camera exposes at. To be called while it does not acquire.
/// @errors as configure_image()
[[nodiscard]] Result<> configure_trigger(const DeviceFeatures& features, const AravisCameraOptions& options,
                                         AravisTrigger trigger);

}  // namespace slsd
