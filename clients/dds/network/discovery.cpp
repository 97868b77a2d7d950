// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "network/discovery.hpp"

#include <map>
#include <sstream>

namespace slsd::dds {
namespace {

constexpr const char* kRange = "ROS_AUTOMATIC_DISCOVERY_RANGE";
constexpr const char* kPeers = "ROS_STATIC_PEERS";
constexpr const char* kLocalhostOnly = "ROS_LOCALHOST_ONLY";

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream from(text);
  for (std::string part; std::getline(from, part, ';');) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

}  // namespace

Discovery read_discovery(const std::function<std::string(const char*)>& variable) {
  using Range = Discovery::Range;
  static const std::map<std::string, Range> kRanges{{"", Range::kSubnet},
                                                    {"SUBNET", Range::kSubnet},
                                                    {"LOCALHOST", Range::kLocalhost},
                                                    {"OFF", Range::kOff},
                                                    {"SYSTEM_DEFAULT", Range::kSystemDefault}};
  Discovery discovery;
  if (variable(kLocalhostOnly) == "1") {
    discovery.range = Range::kLocalhost;
    if (!variable(kPeers).empty())
      discovery.warnings.push_back(std::string(kLocalhostOnly) + "=1: " + kPeers + " is ignored");
    return discovery;
  }
  const std::string range = variable(kRange);
  if (const auto known = kRanges.find(range); known != kRanges.end()) {
    discovery.range = known->second;
  } else {
    discovery.range = Range::kLocalhost;
    discovery.warnings.push_back(std::string(kRange) + " is \"" + range +
                                 "\", not SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT: slsd-dds reaches only this host");
  }
  discovery.peers = split(variable(kPeers));
  const bool ignored = discovery.range == Range::kOff || discovery.range == Range::kSystemDefault;
  if (ignored && !discovery.peers.empty()) {
    discovery.warnings.push_back(std::string(kRange) + "=" + range + ": " + kPeers + " is ignored");
    discovery.peers.clear();
  }
  return discovery;
}

}  // namespace slsd::dds
