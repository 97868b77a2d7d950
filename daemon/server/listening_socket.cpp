// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/listening_socket.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <optional>
#include <thread>

#include <systemd/sd-daemon.h>

#include "daemon/configuration/server_options.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

using namespace std::chrono_literals;

constexpr auto kLockTime = 2s;  // others hold the lock for less than a millisecond
constexpr auto kLockPause = 1ms;
constexpr int kBacklog = 4096;  // room for many short connections while the loop is busy; the kernel may allow fewer

sockaddr_un address_of(const path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  return address;
}

path folder_of(const path& socket) {
  return socket.has_parent_path() ? socket.parent_path() : path(".");
}

FileDescriptor new_socket() {
  return FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

// Checks that the path is free: it has no file, or the socket of a dead daemon.
Result<> check_free(const path& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    return errno == ENOENT ? Result<>() : fail_system(errno, "cannot check the socket's path", path.string());
  }
  if (!S_ISSOCK(status.st_mode)) {
    return fail(ErrorCode::kAlreadyExists, "this path exists and is not a socket: remove it, or choose another path",
                path.string());
  }
  const FileDescriptor probe = new_socket();
  if (!probe) return fail_system(errno, "cannot create a socket", path.string());
  const sockaddr_un address = address_of(path);
  const int connected = ::connect(probe.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  // A full backlog (EAGAIN) is a sign of life too.
  if (connected == 0 || errno == EAGAIN) {
    return fail(ErrorCode::kBusy, "another service runs here: stop it, or choose another path", path.string());
  }
  return errno == ECONNREFUSED ? Result<>()
                               : fail_system(errno, "cannot tell whether another service runs here", path.string());
}

// Locks a folder until the descriptor ends, or its process: of services that start at once, one at a time looks for
// others and takes the path. A folder that cannot be read, or a file system without locks, gives none.
Result<FileDescriptor> lock(const path& folder) {
  FileDescriptor locked(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const auto end = std::chrono::steady_clock::now() + kLockTime;
  while (locked && ::flock(locked.number(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) return FileDescriptor();
    if (std::chrono::steady_clock::now() > end)
      return fail(ErrorCode::kBusy,
                  "a process locks the socket's folder: end it (lslocks names it), or choose another folder",
                  folder.string());
    std::this_thread::sleep_for(kLockPause);
  }
  return locked;
}

constexpr std::string_view kTemporary = ".slsd-";  // the process id follows

// Removes temporary sockets of daemons that were killed during listen_in(). Leaves those of living daemons alone.
void remove_left_behind(const path& folder) {
  std::error_code error;
  std::error_code ignored;
  const std::filesystem::directory_iterator last;
  for (std::filesystem::directory_iterator entry(folder, error); !error && entry != last; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(kTemporary) || !entry->is_socket(ignored)) continue;
    pid_t process = 0;
    const char* end = name.data() + name.size();
    const auto [read_to, failed] = std::from_chars(name.data() + kTemporary.size(), end, process);
    if (failed != std::errc() || read_to != end || process <= 0) continue;
    if (::kill(process, 0) != 0 && errno == ESRCH) std::filesystem::remove(entry->path(), ignored);
  }
}

// Binds to a temporary name and renames it once connections are accepted. Binds through /proc, because a temporary name
// may be too long if the path just fits.
Result<> listen_in(const FileDescriptor& socket, const FileDescriptor& folder, const path& path, mode_t mode) {
  const std::string temporary = std::string(kTemporary) + std::to_string(::getpid());
  const sockaddr_un address = address_of("/proc/self/fd/" + std::to_string(folder.number()) + "/" + temporary);
  ::unlinkat(folder.number(), temporary.c_str(), 0);
  if (::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return fail_system(errno, "cannot create the socket", path.string());
  }
  const bool listening = ::fchmodat(folder.number(), temporary.c_str(), mode, 0) == 0 &&
                         ::listen(socket.number(), kBacklog) == 0 &&
                         ::renameat(folder.number(), temporary.c_str(), AT_FDCWD, path.c_str()) == 0;
  if (listening) return {};
  auto failed = fail_system(errno, "cannot listen on the socket", path.string());
  ::unlinkat(folder.number(), temporary.c_str(), 0);
  return failed;
}

// std::filesystem::equivalent() does not support sockets.
bool same_file(const path& one, const path& other) {
  struct stat a {
  }, b{};
  return ::stat(one.c_str(), &a) == 0 && ::stat(other.c_str(), &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

path path_of(int socket) {
  sockaddr_un address{};
  socklen_t size = sizeof address - 1;  // a path of full length has no terminator otherwise
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  return address.sun_family == AF_UNIX ? path(address.sun_path) : path();
}

// Finds the socket at the path among those that systemd handed over; nothing if there are none.
Result<std::optional<FileDescriptor>> handed_over(const path& path) {
  const int count = ::sd_listen_fds(0);
  if (count <= 0) return std::nullopt;
  std::string others;
  for (int socket = SD_LISTEN_FDS_START; socket < SD_LISTEN_FDS_START + count; ++socket) {
    const auto bound = path_of(socket);
    if (::sd_is_socket(socket, AF_UNIX, SOCK_STREAM, 1) > 0 && same_file(bound, path)) {
      FileDescriptor own(::fcntl(socket, F_DUPFD_CLOEXEC, 0));
      if (!own || ::fcntl(own.number(), F_SETFL, O_NONBLOCK) != 0) {
        return fail_system(errno, "cannot take over the socket from systemd", path.string());
      }
      return own;
    }
    others += (others.empty() ? "" : ", ") + bound.string();
  }
  return fail(
      ErrorCode::kMismatch,
      "systemd listens on " + others +
          " for this service: set [server] socket to that path, or ListenStream= in the socket's unit to this one",
      path.string());
}

}  // namespace

Result<> check_socket_path(const path& path) {
  if (path.string().size() > kMaxSocketPath) {
    return fail(ErrorCode::kInvalidArgument,
                "a socket's path has at most " + std::to_string(kMaxSocketPath) + " bytes: choose a shorter one",
                path.string());
  }
  if (::access(folder_of(path).c_str(), W_OK | X_OK) != 0) {
    return fail_system(errno, "cannot create the socket in this folder", path.string());
  }
  return check_free(path);
}

Result<> check_can_listen(const path& path) {
  const auto inherited = handed_over(path);
  if (!inherited) return tl::unexpected(inherited.error());
  if (*inherited) return {};
  const auto locked = lock(folder_of(path));
  if (!locked) return tl::unexpected(locked.error());
  return check_socket_path(path);
}

Result<ListeningSocket> ListeningSocket::open(const path& path, int mode) {
  auto inherited = handed_over(path);
  if (!inherited) return tl::unexpected(inherited.error());
  if (*inherited) return ListeningSocket(std::move(**inherited), {}, 0);
  const auto locked = lock(folder_of(path));
  if (!locked) return tl::unexpected(locked.error());
  if (auto usable = check_socket_path(path); !usable) return tl::unexpected(usable.error());
  remove_left_behind(folder_of(path));
  const FileDescriptor folder(::open(folder_of(path).c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!folder) return fail_system(errno, "cannot open the socket's folder", path.string());
  FileDescriptor socket = new_socket();
  if (!socket) return fail_system(errno, "cannot create a socket", path.string());
  if (auto listening = listen_in(socket, folder, path, static_cast<mode_t>(mode)); !listening) {
    return tl::unexpected(listening.error());
  }
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return fail_system(errno, "the socket disappeared", path.string());
  return ListeningSocket(std::move(socket), path, status.st_ino);
}

ListeningSocket::~ListeningSocket() {
  struct stat status {};
  if (path_.empty()) return;
  const auto locked = lock(folder_of(path_));  // a service that starts now may be about to take the path
  if (!locked || ::lstat(path_.c_str(), &status) != 0) return;
  if (status.st_ino == inode_) ::unlink(path_.c_str());
}

}  // namespace slsd
