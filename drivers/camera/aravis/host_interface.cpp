// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/host_interface.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <sys/socket.h>

#include <array>
#include <bit>
#include <filesystem>

#include "drivers/camera/listing/sysfs.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {
namespace {

in_addr ipv4_of(const sockaddr* address) {
  return reinterpret_cast<const sockaddr_in*>(address)->sin_addr;
}

std::optional<int> mtu(const std::string& name) {
  return first_number(std::filesystem::path("/sys/class/net") / name / "mtu");
}

// The kernel says -1 where a link has no speed, as the loopback.
std::optional<int> link_speed(const std::string& name) {
  const auto speed = first_number(std::filesystem::path("/sys/class/net") / name / "speed");
  return speed && *speed > 0 ? speed : std::nullopt;
}

}  // namespace

bool HostInterface::reaches(in_addr other) const {
  return ((address.s_addr ^ other.s_addr) & mask.s_addr) == 0;
}

std::string HostInterface::text() const {
  return name + " (" + address_text(address) + "/" + std::to_string(std::popcount(mask.s_addr)) + ")";
}

std::vector<HostInterface> list_host_interfaces() {
  std::vector<HostInterface> interfaces;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return interfaces;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    const bool usable = one->ifa_addr != nullptr && one->ifa_netmask != nullptr && (one->ifa_flags & IFF_UP) != 0;
    if (!usable || one->ifa_addr->sa_family != AF_INET) continue;
    interfaces.push_back({one->ifa_name, ipv4_of(one->ifa_addr), ipv4_of(one->ifa_netmask),
                          ::if_nametoindex(one->ifa_name), link_speed(one->ifa_name), mtu(one->ifa_name)});
  }
  ::freeifaddrs(first);
  return interfaces;
}

std::string address_text(in_addr address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

bool packet_socket_allowed() {
  return static_cast<bool>(FileDescriptor(::socket(PF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL))));
}

}  // namespace slsd
