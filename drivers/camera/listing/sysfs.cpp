// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/listing/sysfs.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>

#include "core/printable.hpp"

namespace slsd {

using std::filesystem::path;

namespace {

bool is_usb3_vision(const path& interface) {
  return first_line(interface / "bInterfaceClass") == "ef" && first_line(interface / "bInterfaceSubClass") == "05";
}

std::string node_of(const path& folder) {
  const auto bus = first_number(folder / "busnum");
  const auto device = first_number(folder / "devnum");
  if (!bus || !device) return {};
  std::array<char, 40> node{};
  std::snprintf(node.data(), node.size(), "/dev/bus/usb/%03d/%03d", *bus, *device);
  return node.data();
}

std::optional<UsbDevice> read_device(const path& folder) {
  UsbDevice device;
  device.vendor_number = first_line(folder / "idVendor");
  if (device.vendor_number.empty()) return std::nullopt;
  device.vendor = first_line(folder / "manufacturer");
  device.model = first_line(folder / "product");
  device.serial = first_line(folder / "serial");
  device.node = node_of(folder);
  device.speed_mbps = first_number(folder / "speed");
  device.usb3_vision = std::ranges::any_of(entries_of(folder), is_usb3_vision);
  return device;
}

}  // namespace

std::string first_line(const path& file) {
  std::string line;
  std::ifstream stream(file);
  std::getline(stream, line);
  return printable(line);
}

std::optional<int> first_number(const path& file) {
  const std::string line = first_line(file);
  int number = 0;
  if (std::from_chars(line.data(), line.data() + line.size(), number).ec != std::errc()) return std::nullopt;
  return number;
}

std::vector<path> entries_of(const path& folder) {
  std::error_code error;
  std::vector<path> entries;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    entries.push_back(entry->path());
  std::ranges::sort(entries);
  return entries;
}

std::optional<UsbDevice> usb_device_of(const path& part) {
  std::error_code error;
  for (path folder = std::filesystem::canonical(part, error); !error && folder.has_relative_path();
       folder = folder.parent_path()) {
    if (auto device = read_device(folder)) return device;
  }
  return std::nullopt;
}

std::vector<UsbDevice> list_usb_devices(const path& sysfs) {
  std::vector<UsbDevice> devices;
  for (const path& folder : entries_of(sysfs / "bus/usb/devices"))
    if (auto device = read_device(folder)) devices.push_back(std::move(*device));
  return devices;
}

}  // namespace slsd
