// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "network/discovery.hpp"

namespace slsd::dds {

/// The ways to reach the other participants.
struct NetworkOptions {
  std::uint32_t domain = 0;        ///< ROS_DOMAIN_ID
  std::string interface;           ///< "eth0", "lo", or an address; empty: all
  std::vector<std::string> peers;  ///< addresses of the others, without multicast; empty: according to `discovery`
  bool best_effort = false;        ///< do not repeat lost clouds and images
  double rate_max_mb = 16;         ///< limit of megabytes per second for clouds and images
  Discovery discovery;             ///< settings of ROS's environment
};

}  // namespace slsd::dds
