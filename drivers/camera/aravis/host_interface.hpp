// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include <optional>
#include <string>
#include <vector>

namespace slsd {

/// An interface of this host that is up and has an IPv4 address.
struct HostInterface {
  std::string name;     ///< "eth1"
  in_addr address{};    ///< in network order
  in_addr mask{};       ///< in network order
  unsigned number = 0;  ///< the kernel's index
  std::optional<int> link_mbps = {};
  std::optional<int> mtu_bytes = {};

  /// Whether the address is in its network, so that it is reached without a router.
  [[nodiscard]] bool reaches(in_addr other) const;
  /// "eth1 (10.0.0.1/24)"
  [[nodiscard]] std::string text() const;
};

/// One for each address.
[[nodiscard]] std::vector<HostInterface> list_host_interfaces();

/// "10.0.0.1"
[[nodiscard]] std::string address_text(in_addr address);

/// Whether this process may take packets before the UDP socket (CAP_NET_RAW).
/// @thread reentrant
[[nodiscard]] bool packet_socket_allowed();

}  // namespace slsd
