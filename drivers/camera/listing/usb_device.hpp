// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace slsd {

/// A device on USB, by what the kernel tells of it in sysfs.
struct UsbDevice {
  std::string vendor;
  std::string model;
  std::string serial;
  std::string vendor_number;  ///< "2676"
  std::string node;           ///< "/dev/bus/usb/001/004"
  std::optional<int> speed_mbps;
  bool usb3_vision = false;  ///< has an interface of that class
};

/// The device that something in sysfs is a part of; nothing if it is not on USB.
/// @param part  a folder of sysfs, as /sys/class/video4linux/video0/device
[[nodiscard]] std::optional<UsbDevice> usb_device_of(const std::filesystem::path& part);

/// All that there are.
/// @param sysfs  "/sys"
[[nodiscard]] std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& sysfs);

}  // namespace slsd
