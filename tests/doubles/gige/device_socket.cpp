// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/device_socket.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

namespace slsd::test {
namespace {

constexpr std::uint16_t kControlPort = 3956;

int bound_socket(const sockaddr_in& address, bool shared) {
  const int made = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (shared) ::setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (::bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return made;
  ::close(made);
  return -1;
}

}  // namespace

sockaddr_in socket_address(in_addr_t address, std::uint16_t port) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_addr.s_addr = address;
  made.sin_port = htons(port);
  return made;
}

int bind_control_port(std::string& address) {
  if (!address.empty()) return bound_socket(socket_address(::inet_addr(address.c_str()), kControlPort), false);
  const int first = ::getpid() * 7;
  for (int i = 0; i < 60000; ++i) {
    const int host = 1 + (first + i) % 60000;
    const std::string tried = "127.77." + std::to_string(host / 250) + "." + std::to_string(1 + host % 250);
    const int made = bound_socket(socket_address(::inet_addr(tried.c_str()), kControlPort), false);
    if (made < 0) continue;
    address = tried;
    return made;
  }
  return -1;
}

int bind_broadcast_port() {
  return bound_socket(socket_address(INADDR_BROADCAST, kControlPort), true);
}

}  // namespace slsd::test
