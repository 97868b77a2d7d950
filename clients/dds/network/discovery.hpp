// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace slsd::dds {

/// The range of discovery from ROS 2's environment (Jazzy and later).
struct Discovery {
  enum class Range {
    kSystemDefault,  ///< Fast DDS's own configuration; peers are ignored
    kSubnet,         ///< multicast, plus the peers
    kLocalhost,      ///< this host, plus the peers
    kOff,            ///< no other participant
  };
  Range range = Range::kSubnet;
  std::vector<std::string> peers;  ///< addresses or names of hosts
  std::vector<std::string> warnings;
};

/// Reads ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS (separated by ;) and ROS_LOCALHOST_ONLY, which overrides them.
/// An unknown range becomes LOCALHOST, as in ROS, so that it never reaches further than intended.
/// @param variable  its value; empty: not set
[[nodiscard]] Discovery read_discovery(const std::function<std::string(const char*)>& variable);

}  // namespace slsd::dds
