// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/list_devices.hpp"

#include <mutex>

#include <arv.h>

namespace slsd {
namespace {

std::string text(const char* from) {
  return from == nullptr ? "" : from;
}

}  // namespace

std::vector<AravisDevice> list_aravis_devices() {
  static std::mutex mutex;  // Aravis keeps one list, whose entries a second call takes away
  const std::lock_guard lock(mutex);
  arv_update_device_list();
  std::vector<AravisDevice> devices;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    AravisDevice device{text(arv_get_device_id(i)),      text(arv_get_device_vendor(i)),
                        text(arv_get_device_model(i)),   text(arv_get_device_serial_nbr(i)),
                        text(arv_get_device_address(i)), text(arv_get_device_protocol(i))};
    if (device.protocol != "GigEVision" && device.protocol != "USB3Vision") continue;
    if (device.protocol == "USB3Vision") device.address.clear();
    devices.push_back(std::move(device));
  }
  return devices;
}

}  // namespace slsd
