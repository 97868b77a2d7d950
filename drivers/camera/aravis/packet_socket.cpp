// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/packet_socket.hpp"

#include <arpa/inet.h>
#include <net/ethernet.h>
#include <sys/socket.h>
#include <unistd.h>

namespace slsd {

bool packet_socket_allowed() {
  const int tried = ::socket(PF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ETH_P_ALL));
  if (tried >= 0) ::close(tried);
  return tried >= 0;
}

}  // namespace slsd
