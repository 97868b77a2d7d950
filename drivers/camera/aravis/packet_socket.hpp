// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Whether this process may take packets before the UDP socket (CAP_NET_RAW).
/// @thread reentrant
[[nodiscard]] bool packet_socket_allowed();

}  // namespace slsd
