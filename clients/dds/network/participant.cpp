// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "network/participant.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>

#include "drivers/system/file_descriptor.hpp"
#include "network/loopback.hpp"

namespace slsd::dds {
namespace {

using eprosima::fastdds::dds::DomainParticipantQos;
using eprosima::fastdds::rtps::FlowControllerDescriptor;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using Range = Discovery::Range;

constexpr const char* kLoopback = "127.0.0.1";
constexpr const char* kMulticast = "239.255.0.1";  // of RTPS
constexpr std::uint32_t kParticipantsMax = 120;    // of one host, tried one by one without multicast
constexpr std::uint64_t kPacePeriodMs = 1;

bool plain(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || std::strchr(".:-_%", c);
  });
}

std::string text_of(const sockaddr* address) {
  char text[INET_ADDRSTRLEN] = {};
  ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(address)->sin_addr, text, sizeof text);
  return text;
}

// Finds an interface by its name or its address.
Result<std::string> address_of_interface(const std::string& interface) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return fail(ErrorCode::kIo, "cannot list the network interfaces");
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(all, ::freeifaddrs);
  for (const ifaddrs* one = all; one; one = one->ifa_next) {
    if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
    if (interface == one->ifa_name || interface == text_of(one->ifa_addr)) return text_of(one->ifa_addr);
  }
  return fail(ErrorCode::kInvalidArgument,
              "this host has no interface of that name with an IPv4 address: run ip address to list them",
              "--interface " + interface);
}

Result<std::string> address_of_host(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (const int status = ::getaddrinfo(host.c_str(), nullptr, &hints, &found); status != 0) {
    return fail(ErrorCode::kInvalidArgument, "the peer has no IPv4 address: " + std::string(::gai_strerror(status)),
                host);
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, ::freeaddrinfo);
  return text_of(found->ai_addr);
}

// Port 0 stands for the ports of the host's first kParticipantsMax participants.
Locator_t locator(const std::string& address) {
  Locator_t locator;
  IPLocator::setIPv4(locator, address);
  return locator;
}

void listen_without_multicast(DomainParticipantQos& qos) {
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficMulticastLocatorList.clear();
  builtin.metatrafficUnicastLocatorList.push_back(Locator_t());  // any; without a locator it would listen to multicast
}

}  // namespace

// Asks a socket, because a unit may hide /proc/sys. The kernel doubles the granted size.
int largest_receive_buffer() {
  constexpr int kMost = 1 << 30;
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &kMost, sizeof kMost);
  return ::getsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0 ? granted / 2 : kMost;
}

Result<DomainParticipantQos> participant_qos(DomainParticipantQos qos, const NetworkOptions& options) {
  if ((!options.interface.empty() && !plain(options.interface)) ||
      !std::all_of(options.peers.begin(), options.peers.end(), plain)) {
    return fail(ErrorCode::kInvalidArgument, "an interface or peer must be a name or an address");
  }
  const Range range = options.peers.empty() ? options.discovery.range : Range::kSubnet;
  std::vector<std::string> peers = options.peers.empty() ? options.discovery.peers : options.peers;
  auto udp = std::make_shared<UDPv4TransportDescriptor>();
  udp->maxInitialPeersRange = kParticipantsMax;
  udp->receiveBufferSize = static_cast<std::uint32_t>(std::min(largest_receive_buffer(), 64 << 20));
  bool alone = range == Range::kOff || (range == Range::kLocalhost && peers.empty());
  if (!options.interface.empty()) {
    const auto address = address_of_interface(options.interface);
    if (!address) return tl::unexpected(address.error());
    udp->interfaceWhiteList.push_back(*address);
    alone = *address == kLoopback;
  }
  qos.transport().use_builtin_transports = false;  // shared memory differs between versions of Fast DDS
  if (alone) qos.transport().user_transports.push_back(loopback_transport(udp));
  if (!alone) qos.transport().user_transports.push_back(udp);

  auto& builtin = qos.wire_protocol().builtin;
  if (range == Range::kLocalhost) peers.emplace_back(kLoopback);
  for (const std::string& peer : peers) {
    const auto address = address_of_host(peer);
    if (!address) return tl::unexpected(address.error());
    builtin.initialPeersList.push_back(locator(*address));
  }
  const bool multicast = (range == Range::kSubnet && options.peers.empty()) || range == Range::kSystemDefault;
  if (!multicast) listen_without_multicast(qos);
  if (multicast && !peers.empty()) builtin.initialPeersList.push_back(locator(kMulticast));
  if (range == Range::kOff) qos.allocation().participants.maximum = 1;  // only itself

  auto pace = std::make_shared<FlowControllerDescriptor>();
  pace->name = kPace;
  pace->period_ms = kPacePeriodMs;
  pace->max_bytes_per_period = static_cast<std::int32_t>(options.rate_max_mb * 1e6 / 1000 * kPacePeriodMs);
  qos.flow_controllers().push_back(pace);

  const std::string enclave = "enclave=/;";
  qos.user_data().assign(enclave.begin(), enclave.end());
  qos.name("/");
  builtin.readerHistoryMemoryPolicy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  builtin.writerHistoryMemoryPolicy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return qos;
}

}  // namespace slsd::dds
