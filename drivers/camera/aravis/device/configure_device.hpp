// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device/device_control.hpp"
#include "drivers/camera/aravis/frames/pixel_layout.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// The properties of a configured camera's frames.
struct DeviceLayout {
  int width_px = 0;
  int height_px = 0;
  PixelLayout pixels;
  std::chrono::nanoseconds period{0};  ///< frame period in free run

  [[nodiscard]] std::size_t bytes() const {
    return packed_bytes(static_cast<std::size_t>(width_px) * height_px, pixels.bits_per_pixel());
  }
};

/// Sets region, pixel format, exposure and gain, turns automatic functions off, and verifies the camera's values.
/// @errors kUnsupported, kMismatch, kDisconnected
[[nodiscard]] Result<DeviceLayout> configure_image(const DeviceFeatures& features, const AravisCameraOptions& options);

/// Sets the exposure time, also while the camera acquires, and verifies it.
/// @errors as configure_image()
[[nodiscard]] Result<> configure_exposure(const DeviceFeatures& features, double exposure_us);

/// Makes the camera's clock follow the network's if the options ask for it; otherwise lets it run on its own.
/// @errors kUnsupported: the camera has no PTP; as configure_image()
[[nodiscard]] Result<> configure_clock(const DeviceFeatures& features, const AravisCameraOptions& options);

/// Sets the trigger of exposures. Call it while the camera does not acquire.
/// @errors as configure_image()
[[nodiscard]] Result<> configure_trigger(const DeviceFeatures& features, const AravisCameraOptions& options,
                                         AravisTrigger trigger);

/// The chunks that are turned on.
struct ChunkSelection {
  bool timestamp = false;
  bool exposure_time = false;
  bool gain = false;

  [[nodiscard]] bool any() const { return timestamp || exposure_time || gain; }
  friend bool operator==(const ChunkSelection&, const ChunkSelection&) = default;
};

/// Makes the camera append the exposure's start, its length and the gain to each frame, if the options ask for it.
/// Chunks that the camera lacks or refuses stay off.
/// @errors as turn_chunks_off()
[[nodiscard]] Result<ChunkSelection> configure_chunks(const DeviceFeatures& features,
                                                      const AravisCameraOptions& options);

/// Turns chunks off: frames contain only images from now on.
/// @errors kUnsupported, kMismatch, kDisconnected
[[nodiscard]] Result<> turn_chunks_off(const DeviceFeatures& features);

/// Reads the size of a frame in bytes: the image, and chunks if turned on. Call it last, because other settings may
/// change the size.
/// @errors kMismatch: differs from the configured size; kUnsupported, kDisconnected
[[nodiscard]] Result<std::size_t> read_payload_bytes(ArvCamera* camera, const DeviceLayout& layout,
                                                     const ChunkSelection& chunks);

}  // namespace slsd
