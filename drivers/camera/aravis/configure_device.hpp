// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device_control.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/pixel_layout.hpp"

namespace slsd {

/// The frames of a camera as it is configured.
struct DeviceLayout {
  int width_px = 0;
  int height_px = 0;
  PixelLayout pixels;
  std::chrono::nanoseconds period{0};  ///< frame period of a camera that runs freely

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

/// The chunks that are on.
struct ChunkSelection {
  bool timestamp = false;
  bool exposure_time = false;
  bool gain = false;

  [[nodiscard]] bool any() const { return timestamp || exposure_time || gain; }
  friend bool operator==(const ChunkSelection&, const ChunkSelection&) = default;
};

/// Has the camera append to each frame when its exposure began, how long it was, and its gain: those of these chunks
/// that it has, where the options say so. What the camera refuses stays off.
/// @errors as turn_chunks_off()
[[nodiscard]] Result<ChunkSelection> configure_chunks(const DeviceFeatures& features,
                                                      const AravisCameraOptions& options);

/// Frames are images and nothing else from now on.
/// @errors kUnsupported, kMismatch, kDisconnected
[[nodiscard]] Result<> turn_chunks_off(const DeviceFeatures& features);

/// Reads the number of bytes that the camera sends for a frame: those of the image, and of the chunks if some are on.
/// Call it after everything else is set, as that might change the number.
/// @errors kMismatch: it is not what the configuration makes; kUnsupported, kDisconnected
[[nodiscard]] Result<std::size_t> read_payload_bytes(ArvCamera* camera, const DeviceLayout& layout,
                                                     const ChunkSelection& chunks);

}  // namespace slsd
