// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace slsd {

/// A pixel format that a camera offers and slsd reads.
struct ListedFormat {
  std::string name;                             ///< the configuration's name for it
  std::vector<std::pair<int, int>> sizes_px{};  ///< width and height; for GigE Vision and USB3 Vision the sensor's

  friend bool operator==(const ListedFormat&, const ListedFormat&) = default;
};

/// A camera that this host can see. Fields that do not apply, or are unknown, are empty.
struct ListedCamera {
  std::string standard;  ///< "V4L2", "GigE Vision" or "USB3 Vision"
  std::string driver;    ///< the configuration's: "v4l2" or "aravis"
  std::string name;      ///< the stable name: `device` or `id` in the configuration
  std::string vendor;
  std::string model;
  std::string serial;
  std::string node;              ///< path of the device node
  std::string kernel_driver;     ///< "uvcvideo", ...
  std::string address;           ///< IPv4
  std::string interface;         ///< this host's interface with its network: "eth1 (10.0.0.1/24)"
  std::optional<int> link_mbps;  ///< speed of the USB link, or of this host's interface
  std::string user;              ///< the controlling program: "a program on this host", ...
  std::vector<ListedFormat> formats;
  std::string problem;  ///< why it cannot be used, and the remedy
};

}  // namespace slsd
