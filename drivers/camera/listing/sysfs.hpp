// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace slsd {

/// The first line of a file, made printable: it may contain text exactly as the device sent it. Empty if the file
/// cannot be read.
[[nodiscard]] std::string first_line(const std::filesystem::path& file);

/// The whole number at the start of the file's first line.
[[nodiscard]] std::optional<int> first_number(const std::filesystem::path& file);

/// The entries of a folder, sorted. Empty if it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder);

/// A USB device according to sysfs.
struct UsbDevice {
  std::string vendor;
  std::string model;
  std::string serial;
  std::string vendor_number;  ///< "2676"
  std::string node;           ///< "/dev/bus/usb/001/004"
  std::optional<int> speed_mbps;
  bool usb3_vision = false;  ///< has an interface of that class
};

/// The USB device that a part in sysfs belongs to; nothing if it is not on USB.
/// @param part  a folder of sysfs, such as /sys/class/video4linux/video0/device
[[nodiscard]] std::optional<UsbDevice> usb_device_of(const std::filesystem::path& part);

/// Lists all USB devices.
/// @param sysfs  "/sys"
[[nodiscard]] std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& sysfs);

}  // namespace slsd
