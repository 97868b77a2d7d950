// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// A device that this host controls.
struct OpenedDevice {
  GObjectPtr<ArvCamera> camera;
  std::string name;     ///< "vendor-serial"
  std::string address;  ///< IPv4, of GigE Vision; else empty
};

/// Finds the device that the options name and takes control of it.
/// @param address  where it was found before; it is looked for there first, which is sooner; may be empty
/// @errors kNotFound, kPermissionDenied (another application controls it), kDisconnected, kUnsupported,
/// kInvalidArgument
/// @thread thread-safe
[[nodiscard]] Result<OpenedDevice> open_device(const AravisCameraOptions& options, const std::string& address);

}  // namespace slsd
