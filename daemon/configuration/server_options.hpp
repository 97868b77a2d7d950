// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// The longest path that a Unix socket can have, in bytes.
inline constexpr std::size_t kMaxSocketPath = 107;

/// The [server] table.
struct ServerOptions {
  std::filesystem::path socket = "/run/slsd/slsd.sock";
  int socket_mode = 0660;               ///< 0 to 0777
  int clients_max = 256;                ///< 1 to 10000; a further client gets an error and is closed
  int request_bytes_max = 1024 * 1024;  ///< 1024 to 16777216; a longer line is an error and ends the connection
  int memory_max_mb = 512;              ///< 16 to 65536; for all clients together; one client may use at most half
  /// Users with each right: names, groups as "@name", or "*" for every user who can open the socket. See AccessRules.
  std::vector<std::string> observe{"*"}, scan{"*"}, administer{"@slsd-admin"};
  int send_timeout_ms = 30'000;  ///< 100 to 600000; drops a client that reads neither 1 MB nor the message by then

  [[nodiscard]] std::chrono::milliseconds send_timeout() const { return std::chrono::milliseconds(send_timeout_ms); }
  [[nodiscard]] std::size_t memory_max_bytes() const { return static_cast<std::size_t>(memory_max_mb) << 20U; }
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const ServerOptions&, const ServerOptions&) = default;
};

}  // namespace slsd
