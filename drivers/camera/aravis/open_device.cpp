// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/open_device.hpp"

#include <arpa/inet.h>
#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "drivers/camera/aravis/gige_probe.hpp"
#include "drivers/camera/aravis/list_devices.hpp"

namespace slsd {
namespace {

constexpr std::chrono::milliseconds kProbe{600};

bool is_address(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool is_named(const std::string& id, const std::string& vendor, const std::string& serial) {
  return id == serial || id == vendor + "-" + serial;
}

GObjectPtr<GInetAddress> inet_address(const std::string& text) {
  return GObjectPtr<GInetAddress>(g_inet_address_new_from_string(text.c_str()));
}

Result<OpenedDevice> control(GObjectPtr<ArvDevice> device, std::string name, std::string address) {
  const bool gige = ARV_IS_GV_DEVICE(device.get());
  if (gige && !arv_gv_device_is_controller(ARV_GV_DEVICE(device.get())))
    return fail(ErrorCode::kPermissionDenied,
                "another application controls the camera; close it there, or wait until its heartbeat has run out",
                name);
  GErrorSlot error;
  GObjectPtr<ArvCamera> camera(arv_camera_new_with_device(device.get(), error.out()));
  if (!camera || error.failed()) return fail(error.code(), "the camera cannot be used: " + error.message(), name);
  return OpenedDevice{std::move(camera), std::move(name), std::move(address)};
}

Result<OpenedDevice> open_gige(const GigeDevice& found) {
  const std::string name = found.vendor + "-" + found.serial;
  const auto interface = inet_address(found.interface);
  const auto address = inet_address(found.address);
  GErrorSlot error;
  GObjectPtr<ArvDevice> device(arv_gv_device_new(interface.get(), address.get(), error.out()));
  if (!device || error.failed()) return fail(error.code(), "the camera cannot be opened: " + error.message(), name);
  return control(std::move(device), name, found.address);
}

Result<OpenedDevice> open_usb3(const AravisDevice& listed) {
  const std::string name = listed.vendor + "-" + listed.serial;
  GErrorSlot error;
  GObjectPtr<ArvDevice> device(arv_open_device(listed.id.c_str(), error.out()));
  if (!device || error.failed())
    return fail(error.failed() ? error.code() : ErrorCode::kPermissionDenied,
                "the camera cannot be opened: " + error.message() +
                    "; if it is a USB camera, check that the udev rules let this user write to it",
                name);
  return control(std::move(device), name, "");
}

std::optional<GigeDevice> found_before(const AravisCameraOptions& options, const std::string& address) {
  if (address.empty()) return std::nullopt;
  auto found = probe_gige_device(address, options.interface, kProbe / 2);
  if (!found || !is_named(options.id, found->vendor, found->serial)) return std::nullopt;
  return std::move(*found);
}

}  // namespace

Result<OpenedDevice> open_device(const AravisCameraOptions& options, const std::string& address) {
  if (is_address(options.id)) {
    const auto found = probe_gige_device(options.id, options.interface, kProbe);
    return found ? open_gige(*found) : tl::unexpected(found.error());
  }
  if (const auto found = found_before(options, address)) return open_gige(*found);
  const auto listed = list_aravis_devices();
  const auto named = std::ranges::find_if(listed, [&](const AravisDevice& device) {
    return options.id == device.id || is_named(options.id, device.vendor, device.serial);
  });
  if (named == listed.end())
    return fail(ErrorCode::kNotFound,
                "no GigE Vision or USB3 Vision camera of this name is found; slsd --list shows those that are. One in "
                "another network is found by its address only",
                options.id);
  if (named->address.empty()) return open_usb3(*named);
  const auto found = probe_gige_device(named->address, options.interface, kProbe);
  return found ? open_gige(*found) : tl::unexpected(found.error());
}

}  // namespace slsd
