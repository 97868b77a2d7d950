// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/list_vision_cameras.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "core/printable.hpp"
#include "drivers/camera/aravis/device/open_device.hpp"
#include "drivers/camera/aravis/frames/pixel_layout.hpp"
#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "drivers/camera/aravis/gige/gige_discovery.hpp"
#include "drivers/camera/listing/sysfs.hpp"

namespace slsd {
namespace {

constexpr std::chrono::milliseconds kWait{700};

std::vector<std::string> pixel_formats_of(ArvCamera* camera) {
  GErrorSlot error;
  guint count = 0;
  const GMemoryPtr<const char*> names(arv_camera_dup_available_pixel_formats_as_strings(camera, &count, error.out()));
  return error.failed() ? std::vector<std::string>() : std::vector<std::string>(names.get(), names.get() + count);
}

void note_formats(const Result<OpenedDevice>& device, ListedCamera& camera) {
  if (!device) {
    camera.problem = device.error().message;
    return;
  }
  GErrorSlot error;
  int width = 0;
  int height = 0;
  arv_camera_get_sensor_size(device->camera.get(), &width, &height, error.out());
  for (const std::string& name : pixel_formats_of(device->camera.get()))
    if (find_pixel_layout(name)) camera.formats.push_back({name, {{width, height}}});
  if (camera.formats.empty()) camera.problem = "it has no pixel format that slsd can read";
}

std::string user_text(const std::string& controller, const std::vector<HostInterface>& interfaces) {
  const std::string address = controller.substr(0, controller.find(':'));
  const bool here = std::ranges::any_of(
      interfaces, [&](const HostInterface& interface) { return address_text(interface.address) == address; });
  return here ? "a program on this host (" + controller + ")" : controller;
}

bool is_among(const GigeDevice& device, const std::vector<std::string>& ids) {
  return std::ranges::any_of(
      ids, [&](const std::string& id) { return id == device.name() || id == device.serial || id == device.address; });
}

void note_control(const GigeDevice& device, const std::vector<HostInterface>& interfaces, bool may_open,
                  ListedCamera& camera) {
  const auto controller = gige_controller(device, kWait);
  if (!controller) {
    camera.problem =
        "it answers only broadcasts, because its address is outside the interface's network; give the camera an "
        "address in that network, or the interface a second one in the camera's network";
  } else if (!controller->empty()) {
    camera.user = user_text(*controller, interfaces);
  } else if (may_open) {
    note_formats(open_gige_device(device), camera);
  }
}

ListedCamera gige_camera(const GigeDevice& device, const std::vector<HostInterface>& interfaces, bool may_open) {
  ListedCamera camera;
  camera.standard = "GigE Vision";
  camera.driver = "aravis";
  camera.name = device.name();
  camera.vendor = device.vendor;
  camera.model = device.model;
  camera.serial = device.serial;
  camera.address = device.address;
  camera.interface = device.interface;
  for (const HostInterface& interface : interfaces) {
    if (address_text(interface.address) != device.interface) continue;
    camera.interface = interface.text();
    camera.link_mbps = interface.link_mbps;
  }
  note_control(device, interfaces, may_open, camera);
  return camera;
}

ListedCamera usb3_camera(const UsbDevice& device, const std::vector<Usb3Device>& openable) {
  ListedCamera camera;
  camera.standard = "USB3 Vision";
  camera.driver = "aravis";
  camera.name = printable(device.vendor) + "-" + printable(device.serial);
  camera.vendor = printable(device.vendor);
  camera.model = printable(device.model);
  camera.serial = printable(device.serial);
  camera.node = device.node;
  camera.link_mbps = device.speed_mbps;
  const auto found = std::ranges::find(openable, camera.serial, &Usb3Device::serial);
  if (::access(device.node.c_str(), R_OK | W_OK) != 0)
    camera.problem = "this user may not write to it; add a udev rule: SUBSYSTEM==\"usb\", ATTRS{idVendor}==\"" +
                     device.vendor_number + R"(", MODE="0660", GROUP="video", and this user to the group video)";
  else if (found == openable.end())
    camera.problem = "it cannot be opened; end the other program that uses it";
  else
    note_formats(open_usb3_device(*found), camera);
  return camera;
}

}  // namespace

std::vector<ListedCamera> list_vision_cameras(const std::filesystem::path& sysfs,
                                              const std::vector<std::string>& configured) {
  const std::vector<HostInterface> interfaces = list_host_interfaces();
  std::vector<GigeDevice> devices = discover_gige_devices(kWait, {});
  for (const std::string& id : configured) {
    if (std::ranges::find(devices, id, &GigeDevice::address) != devices.end()) continue;
    if (auto device = probe_gige_device(id, "", kWait)) devices.push_back(std::move(*device));
  }
  std::vector<ListedCamera> cameras;
  for (const GigeDevice& device : devices)
    cameras.push_back(gige_camera(device, interfaces, is_among(device, configured)));
  std::vector<UsbDevice> usb = list_usb_devices(sysfs);
  std::erase_if(usb, [](const UsbDevice& device) { return !device.usb3_vision; });
  if (usb.empty()) return cameras;
  const std::vector<Usb3Device> openable = list_usb3_devices();
  for (const UsbDevice& device : usb) cameras.push_back(usb3_camera(device, openable));
  return cameras;
}

}  // namespace slsd
