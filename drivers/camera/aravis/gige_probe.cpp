// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige_probe.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::uint16_t kControlPort = 3956;
constexpr std::array<std::uint8_t, 8> kDiscovery{0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0xff, 0xfe};
constexpr std::array<std::uint8_t, 4> kAnswer{0x00, 0x00, 0x00, 0x03};  // status and command of the acknowledgement
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kVendorOffset = 0x48;
constexpr std::size_t kVendorBytes = 32;
constexpr std::size_t kSerialOffset = 0xd8;
constexpr std::size_t kSerialBytes = 16;
constexpr int kTries = 3;

class UdpSocket {
 public:
  UdpSocket() : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~UdpSocket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

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
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &local.sin_addr, text.data(), text.size());
  return text.data();
}

std::string text_at(std::span<const std::uint8_t> data, std::size_t offset, std::size_t bytes) {
  const auto field = data.subspan(offset, bytes);
  return {field.begin(), std::ranges::find(field, 0)};
}

/// The answer's data, if one comes in time. The socket is connected, so that only the device is heard.
std::optional<std::vector<std::uint8_t>> ask(int socket, milliseconds timeout) {
  if (::send(socket, kDiscovery.data(), kDiscovery.size(), MSG_NOSIGNAL) < 0) return std::nullopt;
  pollfd waited{socket, POLLIN, 0};
  if (::poll(&waited, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  std::vector<std::uint8_t> answer(1024);
  const auto bytes = ::recv(socket, answer.data(), answer.size(), 0);
  const bool whole = bytes >= static_cast<ssize_t>(kHeaderBytes + kSerialOffset + kSerialBytes);
  if (!whole || std::memcmp(answer.data(), kAnswer.data(), kAnswer.size()) != 0) return std::nullopt;
  answer.resize(static_cast<std::size_t>(bytes));
  return answer;
}

}  // namespace

Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface, milliseconds timeout) {
  const auto to = socket_address(address, kControlPort);
  const auto from = socket_address(interface.empty() ? "0.0.0.0" : interface, 0);
  if (!to || !from) return fail(ErrorCode::kInvalidArgument, "is no IPv4 address", !to ? address : interface);
  const UdpSocket socket;
  if (::bind(socket.get(), generic(*from), sizeof(*from)) != 0)
    return fail(ErrorCode::kInvalidArgument, "no interface of this host has this address; see ip address", interface);
  if (::connect(socket.get(), generic(*to), sizeof(*to)) == 0) {
    for (int i = 0; i < kTries; ++i) {
      const auto answer = ask(socket.get(), timeout / kTries);
      if (!answer) continue;
      const auto data = std::span(*answer).subspan(kHeaderBytes);
      return GigeDevice{address, local_address(socket.get()), text_at(data, kVendorOffset, kVendorBytes),
                        text_at(data, kSerialOffset, kSerialBytes)};
    }
  }
  return fail(ErrorCode::kNotFound,
              "no camera answers at this address; check its power and cable, that it is in the network of this host's "
              "interface, and that no firewall holds back UDP from port 3956",
              address);
}

}  // namespace slsd
