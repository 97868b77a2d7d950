// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/access.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "core/printable.hpp"
#include "daemon/configuration/server_options.hpp"

namespace slsd {
namespace {

constexpr std::string_view kAll = "*";
constexpr std::size_t kEntryBytes =
    1 << 16;                           // of the host's list; a group of thousands may exceed it, and is then not found
constexpr std::size_t kShownMax = 64;  // of a name in a message

// Uses the reentrant functions, because a reload reads in a separate thread.
std::optional<gid_t> group_number(const std::string& name) {
  std::vector<char> bytes(kEntryBytes);
  group entry{}, *found = nullptr;
  ::getgrnam_r(name.c_str(), &entry, bytes.data(), bytes.size(), &found);
  return found == nullptr ? std::nullopt : std::optional(found->gr_gid);
}
std::optional<uid_t> user_number(const std::string& name) {
  std::vector<char> bytes(kEntryBytes);
  passwd entry{}, *found = nullptr;
  ::getpwnam_r(name.c_str(), &entry, bytes.data(), bytes.size(), &found);
  return found == nullptr ? std::nullopt : std::optional(found->pw_uid);
}

Result<> unknown(std::string_view key, std::string_view kind, std::string_view name) {
  return fail(ErrorCode::kNotFound, std::string(key) + " names the " + std::string(kind) + " \"" +
                                        printable(name, kShownMax) +
                                        "\", which does not exist on this host: create it, or correct the name");
}

}  // namespace

std::string_view to_string(Role role) {
  switch (role) {
    case Role::kNone:
      break;
    case Role::kObserve:
      return "observe";
    case Role::kScan:
      return "scan";
    case Role::kAdminister:
      return "administer";
  }
  return "none";
}

Peer peer_of(int socket) {
  constexpr auto kNobody = std::numeric_limits<uid_t>::max();
  ucred credentials{0, kNobody, kNobody};
  socklen_t size = sizeof credentials;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return {kNobody, kNobody, 0, {}};
  Peer peer{credentials.uid, credentials.gid, credentials.pid, {}};
  socklen_t bytes = 0;
  ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, nullptr, &bytes);  // fails, but returns the number of bytes
  peer.groups.resize(bytes / sizeof(gid_t));
  if (bytes > 0 && ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, peer.groups.data(), &bytes) != 0)
    peer.groups.clear();
  return peer;
}

Result<AccessRules> AccessRules::of(const ServerOptions& options) {
  static const ServerOptions kDefaults;
  struct Key {
    Role role;
    std::string_view name;
    const std::vector<std::string>&given, &by_default;
  };
  AccessRules rules;
  for (const Key& key : {Key{Role::kObserve, "observe", options.observe, kDefaults.observe},
                         Key{Role::kScan, "scan", options.scan, kDefaults.scan},
                         Key{Role::kAdminister, "administer", options.administer, kDefaults.administer}}) {
    Names& names = rules.names_[static_cast<std::size_t>(key.role)];
    std::string& way = rules.ways_[static_cast<std::size_t>(key.role)];
    way = "let an administrator add you to [server] " + std::string(key.name) + ", then reconnect";
    const bool may_be_missing = key.given == key.by_default;
    for (const std::string& name : key.given) {
      if (name.empty() || name == "@")
        return fail(ErrorCode::kInvalidArgument, std::string(key.name) + " has an empty name: remove it");
      if (name == kAll) {
        names.all = true;
      } else if (name.front() == '@') {
        if (const auto number = group_number(name.substr(1))) {
          names.groups.push_back(*number);
          way = "join the group " + name.substr(1) + ", then log in again: a process keeps the groups of its login";
        } else if (!may_be_missing) {
          return tl::unexpected(unknown(key.name, "group", name.substr(1)).error());
        }
      } else if (const auto number = user_number(name)) {
        names.users.push_back(*number);
      } else if (!may_be_missing) {
        return tl::unexpected(unknown(key.name, "user", name).error());
      }
    }
  }
  return rules;
}

Role AccessRules::role_of(const Peer& peer) const {
  if (peer.user == 0 || peer.user == ::geteuid()) return Role::kAdminister;
  const auto admits = [&](Role role) {
    const Names& names = names_[static_cast<std::size_t>(role)];
    const auto in_group = [&](gid_t group) { return std::ranges::find(names.groups, group) != names.groups.end(); };
    return names.all || std::ranges::find(names.users, peer.user) != names.users.end() || in_group(peer.group) ||
           std::ranges::any_of(peer.groups, in_group);
  };
  for (const Role role : {Role::kAdminister, Role::kScan, Role::kObserve})
    if (admits(role)) return role;
  return Role::kNone;
}

}  // namespace slsd
