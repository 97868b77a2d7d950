// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/access/cannot_listen.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace slsd {
namespace {

namespace fs = std::filesystem;

// The "socket:[inode]" names of listeners at the port, from the kernel's tables (proc(5)).
std::vector<std::string> listening_sockets(int port) {
  std::vector<std::string> sockets;
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream file(table);
    std::string line;
    std::getline(file, line);  // the header row
    while (std::getline(file, line)) {
      std::istringstream columns(line);
      std::string slot, local, remote, state, queues, timer, retransmits, user, timeout, inode;
      columns >> slot >> local >> remote >> state >> queues >> timer >> retransmits >> user >> timeout >> inode;
      const std::size_t colon = local.find(':');
      if (!columns || state != "0A" || colon == std::string::npos) continue;
      if (std::stoi(local.substr(colon + 1), nullptr, 16) == port) sockets.push_back("socket:[" + inode + "]");
    }
  }
  return sockets;
}

bool has_one_of(const fs::path& process, const std::vector<std::string>& sockets) {
  std::error_code hidden;
  for (fs::directory_iterator each(process / "fd", hidden), end; !hidden && each != end; each.increment(hidden)) {
    std::error_code gone;
    const std::string target = fs::read_symlink(each->path(), gone).string();
    if (!gone && std::ranges::find(sockets, target) != sockets.end()) return true;
  }
  return false;
}

// The program that listens at the port.
std::optional<std::string> port_holder(int port) {
  const std::vector<std::string> sockets = listening_sockets(port);
  if (sockets.empty()) return std::nullopt;
  std::error_code hidden;
  for (fs::directory_iterator each("/proc", hidden), end; !hidden && each != end; each.increment(hidden)) {
    const std::string number = each->path().filename().string();
    if (number.find_first_not_of("0123456789") != std::string::npos || !has_one_of(each->path(), sockets)) continue;
    std::ifstream file(each->path() / "comm");
    std::string name;
    std::getline(file, name);
    return name + " (process " + number + ")";
  }
  return std::nullopt;
}

}  // namespace

Error cannot_listen(const std::string& address, int port, const std::error_code& error) {
  const std::string where = address + ":" + std::to_string(port);
  // By number: the categories of Asio and Boost differ.
  if (error.value() == EADDRINUSE) {
    const std::string holder = port_holder(port).value_or("another program");
    return {ErrorCode::kIo, "the port is in use by " + holder + ": stop it, or choose another port with --port", where};
  }
  if (error.value() == EACCES)
    return {ErrorCode::kIo, "only root may listen on ports below 1024: choose another with --port", where};
  return {ErrorCode::kIo, "cannot listen on this address (" + error.message() + "): choose an address of this machine",
          where};
}

}  // namespace slsd
