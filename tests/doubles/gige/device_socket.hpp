// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

namespace slsd::test {

[[nodiscard]] sockaddr_in socket_address(in_addr_t address, std::uint16_t port);

/// A socket on the port where a GigE Vision device is asked; -1 if it cannot be had.
/// @param address  of this host; empty: becomes one of 127.77.0.0/16 that no other program has
[[nodiscard]] int bind_control_port(std::string& address);

/// A socket that hears what is asked of all devices.
[[nodiscard]] int bind_broadcast_port();

}  // namespace slsd::test
