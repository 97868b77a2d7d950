// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

namespace slsd {

/// A GigE Vision or USB3 Vision camera that this host can see.
struct AravisDevice {
  std::string id;  ///< as Aravis names it
  std::string vendor;
  std::string model;
  std::string serial;
  std::string address;   ///< IPv4 of GigE Vision; empty for USB3 Vision
  std::string protocol;  ///< "GigEVision" or "USB3Vision"
};

/// Asks all networks and USB; takes a second or two.
/// @thread thread-safe
[[nodiscard]] std::vector<AravisDevice> list_aravis_devices();

}  // namespace slsd
