// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

/// A USB3 Vision camera that Aravis can open.
struct Usb3Device {
  std::string id;  ///< Aravis's name for the device
  std::string vendor;
  std::string serial;
};

/// @thread thread-safe
[[nodiscard]] std::vector<Usb3Device> list_usb3_devices();

/// A device that this host controls.
struct OpenedDevice {
  GObjectPtr<ArvCamera> camera;
  std::string name;     ///< "vendor-serial"
  std::string address;  ///< IPv4 address of a GigE Vision device; else empty
};

/// Finds the device that the options name and takes control of it. Waits briefly if another application has control,
/// because a session before a network failure may still hold it.
/// @param address  where the device was found before; tried first, which is faster; may be empty
/// @errors kNotFound, kPermissionDenied (another application controls it), kDisconnected, kUnsupported,
/// kInvalidArgument
/// @thread thread-safe
[[nodiscard]] Result<OpenedDevice> open_device(const AravisCameraOptions& options, const std::string& address);

/// Takes control of a known device.
/// @errors as open_device()
/// @thread thread-safe
[[nodiscard]] Result<OpenedDevice> open_gige_device(const GigeDevice& found);
[[nodiscard]] Result<OpenedDevice> open_usb3_device(const Usb3Device& listed);

}  // namespace slsd
