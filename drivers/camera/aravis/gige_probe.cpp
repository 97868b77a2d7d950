// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige_probe.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/types.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/aravis/host_interface.hpp"
#include "drivers/camera/aravis/udp_socket.hpp"

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using Bytes = std::span<const std::uint8_t>;

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

/// One device's port, connected, so that only the device is heard.
class ControlChannel {
 public:
  /// @errors as probe_gige_device()
  [[nodiscard]] Result<> connect(const std::string& address, const std::string& interface) const {
    const auto to = socket_address(address, kGvcpPort);
    const auto from = socket_address(interface.empty() ? "0.0.0.0" : interface, 0);
    if (!to || !from) return fail(ErrorCode::kInvalidArgument, "is no IPv4 address", !to ? address : interface);
    if (::bind(socket_.get(), generic(*from), sizeof(*from)) != 0)
      return fail(ErrorCode::kInvalidArgument, "no interface of this host has this address; see ip address", interface);
    (void)::connect(socket_.get(), generic(*to), sizeof(*to));  // where it cannot, nothing will answer
    return {};
  }

  /// What the reader makes of the answer to the question, if it comes in time; that to an earlier one may come late.
  template <class Question, class Reader>
  [[nodiscard]] auto ask(Question question, Reader read, milliseconds timeout) -> decltype(read(Bytes(), 0)) {
    const std::uint16_t id = ++id_ == 0 ? ++id_ : id_;
    const auto asked = question(id);
    for (int i = 0; i < kTries; ++i) {
      if (::send(socket_.get(), asked.data(), asked.size(), MSG_NOSIGNAL) < 0) continue;
      const auto end = steady_clock::now() + timeout / kTries;
      for (Bytes answer = receive(end); !answer.empty(); answer = receive(end))
        if (auto value = read(answer, id)) return value;
    }
    return std::nullopt;
  }

  void tell(Bytes command) const { (void)::send(socket_.get(), command.data(), command.size(), MSG_NOSIGNAL); }

  [[nodiscard]] std::string interface() const { return local_address(socket_.get()); }

 private:
  /// What comes next; empty if nothing does before the end.
  [[nodiscard]] Bytes receive(steady_clock::time_point end) {
    const auto left = std::chrono::ceil<milliseconds>(end - steady_clock::now());
    pollfd waited{socket_.get(), POLLIN, 0};
    if (left.count() <= 0 || ::poll(&waited, 1, static_cast<int>(left.count())) <= 0) return {};
    const auto bytes = ::recv(socket_.get(), answer_.data(), answer_.size(), 0);
    return Bytes(answer_).first(static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
  }

  UdpSocket socket_;
  std::uint16_t id_ = 0;
  std::vector<std::uint8_t> answer_ = std::vector<std::uint8_t>(1024);
};

}  // namespace

Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface, milliseconds timeout) {
  ControlChannel channel;
  if (auto connected = channel.connect(address, interface); !connected) return tl::unexpected(connected.error());
  auto device = channel.ask(gvcp_discovery, read_gvcp_discovery, timeout);
  if (!device)
    return fail(ErrorCode::kNotFound,
                "no camera answers at this address; check its power and cable, that it is in the network of this "
                "host's interface, and that no firewall holds back UDP from port 3956",
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
  const ControlChannel channel;
  if (channel.connect(address, interface)) channel.tell(gvcp_action(keys, ticks));
}

}  // namespace slsd
