// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige/gige_discovery.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "drivers/system/file_descriptor.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using Bytes = std::span<const std::uint8_t>;
using ControlBuffer = std::array<char, CMSG_SPACE(sizeof(in_pktinfo))>;

constexpr int kTries = 3;
constexpr std::uint32_t kControlPrivilege = 0xa00;
constexpr std::uint32_t kControlled = 3;  // exclusively or not
constexpr std::uint32_t kControllerPort = 0xa04;
constexpr std::uint32_t kControllerAddress = 0xa14;

std::optional<sockaddr_in> socket_address(const std::string& text, std::uint16_t port) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_port = htons(port);
  if (::inet_pton(AF_INET, text.c_str(), &made.sin_addr) != 1) return std::nullopt;
  return made;
}

const sockaddr* generic(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

std::string local_address(int socket) {
  sockaddr_in local{};
  socklen_t bytes = sizeof(local);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&local), &bytes);
  return address_text(local.sin_addr);
}

FileDescriptor udp_socket() {
  return FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
}

/// One device's port. The socket is connected, so that it hears only the device.
class ControlChannel {
 public:
  /// @errors as probe_gige_device()
  [[nodiscard]] Result<> connect(const std::string& address, const std::string& interface) {
    const auto to = socket_address(address, kGvcpPort);
    const auto from = socket_address(interface.empty() ? "0.0.0.0" : interface, 0);
    if (!to || !from) return fail(ErrorCode::kInvalidArgument, "is not an IPv4 address", !to ? address : interface);
    socket_ = udp_socket();
    if (!socket_) return fail_system(errno, "cannot open a socket", address);
    if (::bind(socket_.number(), generic(*from), sizeof(*from)) != 0)
      return fail(ErrorCode::kInvalidArgument,
                  "no interface of this host has this address; run ip address to list them", interface);
    (void)::connect(socket_.number(), generic(*to), sizeof(*to));  // if this fails, nothing will answer
    return {};
  }

  /// Sends the query and returns the reader's result for its answer, if that comes in time. Answers to earlier queries
  /// may come late.
  template <class Question, class Reader>
  [[nodiscard]] auto ask(Question question, Reader read, milliseconds timeout) -> decltype(read(Bytes(), 0)) {
    const std::uint16_t id = ++id_ == 0 ? ++id_ : id_;
    const auto asked = question(id);
    for (int i = 0; i < kTries; ++i) {
      if (::send(socket_.number(), asked.data(), asked.size(), MSG_NOSIGNAL) < 0) continue;
      const auto end = steady_clock::now() + timeout / kTries;
      for (Bytes answer = receive(end); !answer.empty(); answer = receive(end))
        if (auto value = read(answer, id)) return value;
    }
    return std::nullopt;
  }

  void tell(Bytes command) const { (void)::send(socket_.number(), command.data(), command.size(), MSG_NOSIGNAL); }

  [[nodiscard]] std::string interface() const { return local_address(socket_.number()); }

 private:
  /// Receives the next datagram; empty if none comes before the end.
  [[nodiscard]] Bytes receive(steady_clock::time_point end) {
    const auto left = std::chrono::ceil<milliseconds>(end - steady_clock::now());
    pollfd waited{socket_.number(), POLLIN, 0};
    if (left.count() <= 0 || ::poll(&waited, 1, static_cast<int>(left.count())) <= 0) return {};
    const auto bytes = ::recv(socket_.number(), answer_.data(), answer_.size(), 0);
    return Bytes(answer_).first(static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
  }

  FileDescriptor socket_;
  std::uint16_t id_ = 0;
  std::vector<std::uint8_t> answer_ = std::vector<std::uint8_t>(1024);
};

constexpr int kQuestions = 2;             // one query may be lost
constexpr std::uint16_t kQuestionId = 1;  // shared by both: either answer suffices

/// Sends to every device on the interface's network, whatever the routes are.
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
  (void)::sendmsg(socket, &message, MSG_NOSIGNAL);  // if sending fails, no device can be found there
}

/// The kernel's index of the interface that received a message.
unsigned interface_of(msghdr& message) {
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != IPPROTO_IP || header->cmsg_type != IP_PKTINFO) continue;
    in_pktinfo through{};
    std::memcpy(&through, CMSG_DATA(header), sizeof(through));
    return static_cast<unsigned>(through.ipi_ifindex);
  }
  return 0;
}

/// The interface's address in the device's network; else its first.
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

Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface, milliseconds timeout) {
  ControlChannel channel;
  if (auto connected = channel.connect(address, interface); !connected) return tl::unexpected(connected.error());
  auto device = channel.ask(gvcp_discovery, read_gvcp_discovery, timeout);
  if (!device)
    return fail(ErrorCode::kNotFound,
                "no camera answers at this address; check its power and cable, that its address is in this host's "
                "network, and that no firewall blocks UDP port 3956",
                address);
  device->address = address;
  device->interface = channel.interface();
  return std::move(*device);
}

std::optional<std::string> gige_controller(const GigeDevice& device, milliseconds timeout) {
  ControlChannel channel;
  if (!channel.connect(device.address, device.interface)) return std::nullopt;
  const auto read = [&](std::uint32_t address) {
    return channel.ask([&](std::uint16_t id) { return gvcp_read(address, id); }, read_gvcp_value, timeout);
  };
  const auto privilege = read(kControlPrivilege);
  if (!privilege) return std::nullopt;
  if ((*privilege & kControlled) == 0) return "";
  const in_addr address{htonl(read(kControllerAddress).value_or(0))};
  if (address.s_addr == 0) return "another application";
  return address_text(address) + ":" + std::to_string(read(kControllerPort).value_or(0) & 0xffff);
}

void send_gige_action(const std::string& address, const std::string& interface, const ActionKeys& keys,
                      std::optional<std::uint64_t> ticks) {
  ControlChannel channel;
  if (channel.connect(address, interface)) channel.tell(gvcp_action(keys, ticks));
}

std::vector<GigeDevice> discover_gige_devices(milliseconds wait, const std::function<bool(const GigeDevice&)>& enough) {
  const std::vector<HostInterface> interfaces = list_host_interfaces();
  const FileDescriptor socket = udp_socket();
  const int on = 1;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_BROADCAST, &on, sizeof(on));
  ::setsockopt(socket.number(), IPPROTO_IP, IP_PKTINFO, &on, sizeof(on));
  std::vector<GigeDevice> devices;
  for (int i = 0; i < kQuestions; ++i) {
    for (const HostInterface& interface : interfaces) ask_everyone(socket.number(), interface);
    if (gather(socket.number(), interfaces, steady_clock::now() + wait / kQuestions, enough, devices)) break;
  }
  return devices;
}

}  // namespace slsd
