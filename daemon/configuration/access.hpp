// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd {

struct ServerOptions;

/// The rights of a client. Each role includes the previous ones.
enum class Role : std::uint8_t { kNone, kObserve, kScan, kAdminister };
[[nodiscard]] std::string_view to_string(Role role);

/// The peer of a Unix socket, as the kernel reports it.
struct Peer {
  uid_t user;
  gid_t group;
  pid_t process;
  std::vector<gid_t> groups;  ///< the user's other groups
};
/// @return  if the socket is closed, a user without rights
[[nodiscard]] Peer peer_of(int socket);

/// The rights by user and group: [server] observe, scan and administer, with names resolved to numbers.
class AccessRules {
 public:
  /// Names of users, of groups as "@name", or "*" for every user who can open the socket.
  /// @errors kNotFound: a user or group unknown to this host, except the defaults; kInvalidArgument: an empty name
  [[nodiscard]] static Result<AccessRules> of(const ServerOptions& options);

  /// The role of a peer. Root, and the user who runs the service, have all rights.
  [[nodiscard]] Role role_of(const Peer& peer) const;
  /// The remedy for a missing role: "join the group slsd-admin, then log in again: ...".
  [[nodiscard]] const std::string& way_to(Role role) const { return ways_[static_cast<std::size_t>(role)]; }

 private:
  struct Names {
    bool all = false;
    std::vector<uid_t> users;
    std::vector<gid_t> groups;
  };
  static constexpr std::size_t kRoles = 4;
  std::array<Names, kRoles> names_;
  std::array<std::string, kRoles> ways_;
};

}  // namespace slsd
