// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/listening_socket.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

#include "daemon/configuration/server_options.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr int kBacklog = 4096;  // many short connections at once find the loop busy; the kernel may allow fewer

ErrorCode code_of(int number) {
  switch (number) {
    case ENOENT:
    case ENOTDIR:
      return ErrorCode::kNotFound;
    case EACCES:
    case EPERM:
    case EROFS:
      return ErrorCode::kPermissionDenied;
    case ENOSPC:
      return ErrorCode::kNoSpace;
    default:
      return ErrorCode::kIo;
  }
}

tl::unexpected<Error> fail_with_errno(const std::string& what, const path& where) {
  const int number = errno;
  return fail(code_of(number), what + ": " + std::strerror(number), where.string());
}

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

// Whether the path is free to take: nothing there, or the socket of a daemon that is dead.
Result<> check_free(const path& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    return errno == ENOENT ? Result<>() : fail_with_errno("cannot look at the socket's path", path);
  }
  if (!S_ISSOCK(status.st_mode)) {
    return fail(ErrorCode::kAlreadyExists, "there is something that is no socket: choose another path, or remove it",
                path.string());
  }
  const FileDescriptor probe = new_socket();
  if (!probe) return fail_with_errno("cannot make a socket", path);
  const sockaddr_un address = address_of(path);
  const int connected = ::connect(probe.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  // A full backlog (EAGAIN) is a sign of life too.
  if (connected == 0 || errno == EAGAIN) {
    return fail(ErrorCode::kBusy, "another daemon answers there: stop it, or choose another path", path.string());
  }
  return errno == ECONNREFUSED ? Result<>() : fail_with_errno("cannot tell whether a daemon answers there", path);
}

// Binds under a name of its own and renames when connections are taken. By way of /proc, as a temporary name may not
// fit where the path just fits.
Result<> listen_in(const FileDescriptor& socket, const FileDescriptor& folder, const path& path, mode_t mode) {
  const std::string temporary = ".slsd-" + std::to_string(::getpid());
  const sockaddr_un address = address_of("/proc/self/fd/" + std::to_string(folder.number()) + "/" + temporary);
  ::unlinkat(folder.number(), temporary.c_str(), 0);
  if (::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return fail_with_errno("cannot make the socket", path);
  }
  const bool listening = ::fchmodat(folder.number(), temporary.c_str(), mode, 0) == 0 &&
                         ::listen(socket.number(), kBacklog) == 0 &&
                         ::renameat(folder.number(), temporary.c_str(), AT_FDCWD, path.c_str()) == 0;
  if (listening) return {};
  auto failed = fail_with_errno("cannot listen at the socket", path);
  ::unlinkat(folder.number(), temporary.c_str(), 0);
  return failed;
}

}  // namespace

Result<> check_socket_path(const path& path) {
  if (path.string().size() > kMaxSocketPath) {
    return fail(ErrorCode::kInvalidArgument,
                "a socket's path has at most " + std::to_string(kMaxSocketPath) + " bytes: choose a shorter one",
                path.string());
  }
  if (::access(folder_of(path).c_str(), W_OK | X_OK) != 0) {
    return fail_with_errno("cannot make the socket in this folder", path);
  }
  return check_free(path);
}

Result<ListeningSocket> ListeningSocket::open(const path& path, int mode) {
  if (auto usable = check_socket_path(path); !usable) return tl::unexpected(usable.error());
  const FileDescriptor folder(::open(folder_of(path).c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!folder) return fail_with_errno("cannot open the socket's folder", path);
  FileDescriptor socket = new_socket();
  if (!socket) return fail_with_errno("cannot make a socket", path);
  if (auto listening = listen_in(socket, folder, path, static_cast<mode_t>(mode)); !listening) {
    return tl::unexpected(listening.error());
  }
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return fail_with_errno("the socket is gone again", path);
  return ListeningSocket(std::move(socket), path, status.st_ino);
}

ListeningSocket::~ListeningSocket() {
  struct stat status {};
  if (path_.empty() || ::lstat(path_.c_str(), &status) != 0) return;
  if (status.st_ino == inode_) ::unlink(path_.c_str());
}

}  // namespace slsd
