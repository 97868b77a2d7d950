// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige_discovery.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "drivers/camera/aravis/host_interface.hpp"
#include "drivers/camera/aravis/udp_socket.hpp"

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kQuestions = 2;             // one may be lost
constexpr std::uint16_t kQuestionId = 1;  // of both: either answer will do

using ControlBuffer = std::array<char, CMSG_SPACE(sizeof(in_pktinfo))>;

/// Sends to everyone on the interface's network, whatever the routes say.
void ask_everyone(int socket, const HostInterface& interface) {
  auto question = gvcp_discovery(kQuestionId);
  iovec part{question.data(), question.size()};
  sockaddr_in everyone{};
  everyone.sin_family = AF_INET;
  everyone.sin_port = htons(kGvcpPort);
  everyone.sin_addr.s_addr = INADDR_BROADCAST;
  alignas(cmsghdr) ControlBuffer control{};
  msghdr message{};
  message.msg_name = &everyone;
  message.msg_namelen = sizeof(everyone);
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = IPPROTO_IP;
  header->cmsg_type = IP_PKTINFO;
  header->cmsg_len = CMSG_LEN(sizeof(in_pktinfo));
  in_pktinfo through{};
  through.ipi_ifindex = static_cast<int>(interface.number);
  through.ipi_spec_dst = interface.address;
  std::memcpy(CMSG_DATA(header), &through, sizeof(through));
  (void)::sendmsg(socket, &message, MSG_NOSIGNAL);  // an interface that takes nothing has no device to find
}

/// The kernel's index of the interface that a message came through.
unsigned interface_of(msghdr& message) {
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != IPPROTO_IP || header->cmsg_type != IP_PKTINFO) continue;
    in_pktinfo through{};
    std::memcpy(&through, CMSG_DATA(header), sizeof(through));
    return static_cast<unsigned>(through.ipi_ifindex);
  }
  return 0;
}

/// Of the interface's addresses the one in the device's network; else its first.
std::string local_address(const std::vector<HostInterface>& interfaces, unsigned number, in_addr device) {
  std::string address;
  for (const HostInterface& interface : interfaces) {
    if (interface.number != number) continue;
    if (interface.reaches(device)) return address_text(interface.address);
    if (address.empty()) address = address_text(interface.address);
  }
  return address;
}

std::optional<GigeDevice> receive(int socket, const std::vector<HostInterface>& interfaces) {
  std::array<std::uint8_t, 1024> bytes{};
  iovec part{bytes.data(), bytes.size()};
  sockaddr_in from{};
  alignas(cmsghdr) ControlBuffer control{};
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof(from);
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const auto count = ::recvmsg(socket, &message, MSG_DONTWAIT);
  if (count < 0) return std::nullopt;
  auto device = read_gvcp_discovery(std::span(bytes).first(static_cast<std::size_t>(count)), kQuestionId);
  if (!device) return std::nullopt;
  device->address = address_text(from.sin_addr);
  device->interface = local_address(interfaces, interface_of(message), from.sin_addr);
  return device;
}

/// Adds the devices that answer before the end. @return whether one of them is enough
bool gather(int socket, const std::vector<HostInterface>& interfaces, steady_clock::time_point end,
            const std::function<bool(const GigeDevice&)>& enough, std::vector<GigeDevice>& devices) {
  for (auto now = steady_clock::now(); now < end; now = steady_clock::now()) {
    pollfd waited{socket, POLLIN, 0};
    const auto left = std::chrono::ceil<milliseconds>(end - now);
    if (::poll(&waited, 1, static_cast<int>(left.count())) <= 0) continue;
    auto device = receive(socket, interfaces);
    if (!device || std::ranges::find(devices, device->address, &GigeDevice::address) != devices.end()) continue;
    devices.push_back(std::move(*device));
    if (enough && enough(devices.back())) return true;
  }
  return false;
}

}  // namespace

std::vector<GigeDevice> discover_gige_devices(milliseconds wait, const std::function<bool(const GigeDevice&)>& enough) {
  const std::vector<HostInterface> interfaces = list_host_interfaces();
  const UdpSocket socket;
  const int on = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof(on));
  ::setsockopt(socket.get(), IPPROTO_IP, IP_PKTINFO, &on, sizeof(on));
  std::vector<GigeDevice> devices;
  for (int i = 0; i < kQuestions; ++i) {
    for (const HostInterface& interface : interfaces) ask_everyone(socket.get(), interface);
    if (gather(socket.get(), interfaces, steady_clock::now() + wait / kQuestions, enough, devices)) break;
  }
  return devices;
}

}  // namespace slsd
