// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/usb3_devices.hpp"

#include <mutex>
#include <string_view>

#include <arv.h>

#include "core/printable.hpp"

namespace slsd {
namespace {

std::string text(const char* from) {
  return from == nullptr ? "" : from;
}

}  // namespace

std::vector<Usb3Device> list_usb3_devices() {
  static std::mutex mutex;  // Aravis keeps one list, whose entries a second call takes away
  const std::lock_guard lock(mutex);
  arv_disable_interface("GigEVision");  // asks each network for a second; discover_gige_devices() knows already
  arv_update_device_list();
  std::vector<Usb3Device> devices;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    if (std::string_view(text(arv_get_device_protocol(i))) != "USB3Vision") continue;
    devices.push_back({text(arv_get_device_id(i)), printable(text(arv_get_device_vendor(i))),
                       printable(text(arv_get_device_serial_nbr(i)))});
  }
  return devices;
}

}  // namespace slsd
