// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/list_v4l2_cameras.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include "drivers/camera/listing/sysfs.hpp"
#include "drivers/camera/v4l2/frame_layout.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

std::optional<int> number_of(const path& node) {
  const std::string name = node.filename().string();
  constexpr std::string_view kPrefix = "video";
  int number = 0;
  if (!name.starts_with(kPrefix)) return std::nullopt;
  const char* end = name.data() + name.size();
  const auto read = std::from_chars(name.data() + kPrefix.size(), end, number);
  return read.ec == std::errc() && read.ptr == end ? std::optional(number) : std::nullopt;
}

std::vector<path> nodes_in(const path& devices, const std::vector<path>& more) {
  std::error_code error;
  std::vector<path> nodes;
  for (const path& entry : entries_of(devices))
    if (number_of(entry)) nodes.push_back(entry);
  std::ranges::sort(nodes, {}, [](const path& node) { return *number_of(node); });
  for (const path& wanted : more) {
    const path node = std::filesystem::canonical(wanted, error);
    if (!error && std::ranges::find(nodes, node) == nodes.end()) nodes.push_back(node);
  }
  return nodes;
}

void note_modes(const V4l2Device& device, ListedCamera& camera) {
  for (const FrameMode& mode : list_modes(device, {})) {
    const std::string name = fourcc_name(mode.format.fourcc);
    auto format = std::ranges::find(camera.formats, name, &ListedFormat::name);
    if (format == camera.formats.end()) format = camera.formats.insert(format, {name});
    format->sizes_px.emplace_back(mode.width_px, mode.height_px);
  }
  if (camera.formats.empty()) camera.problem = "it has no pixel format that slsd can read";
}

std::optional<ListedCamera> look_at(const path& node, const path& devices, const path& sysfs) {
  const path kernel = sysfs / "class/video4linux" / node.filename();
  ListedCamera camera;
  camera.standard = "V4L2";
  camera.driver = "v4l2";
  camera.name = find_stable_link(node, devices).value_or(node).string();
  camera.node = node.string();
  camera.model = first_line(kernel / "name");
  if (const auto usb = usb_device_of(kernel / "device")) {
    camera.vendor = usb->vendor;
    camera.serial = usb->serial;
    camera.link_mbps = usb->speed_mbps;
  }
  const auto device = V4l2Device::open(node.string());
  if (!device && device.error().code == ErrorCode::kUnsupported) return std::nullopt;
  if (!device) {
    camera.problem = device.error().message;
    return camera;
  }
  camera.model = device->card();
  camera.kernel_driver = device->driver();
  note_modes(*device, camera);
  return camera;
}

}  // namespace

std::vector<ListedCamera> list_v4l2_cameras(const path& devices, const path& sysfs, const std::vector<path>& more) {
  std::vector<ListedCamera> cameras;
  for (const path& node : nodes_in(devices, more))
    if (auto camera = look_at(node, devices, sysfs)) cameras.push_back(std::move(*camera));
  return cameras;
}

}  // namespace slsd
