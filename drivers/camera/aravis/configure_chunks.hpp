// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device_features.hpp"

namespace slsd {

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

}  // namespace slsd
