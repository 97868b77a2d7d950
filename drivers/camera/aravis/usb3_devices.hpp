// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

namespace slsd {

/// A USB3 Vision camera that Aravis can open.
struct Usb3Device {
  std::string id;  ///< as Aravis names it
  std::string vendor;
  std::string serial;
};

/// @thread thread-safe
[[nodiscard]] std::vector<Usb3Device> list_usb3_devices();

}  // namespace slsd
