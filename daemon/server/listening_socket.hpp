// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "core/result.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// A Unix stream socket at a path. The destructor removes the path again.
/// @thread thread-bound
class ListeningSocket {
 public:
  /// Listens at the path. Uses the socket that systemd hands over, if any (sd_listen_fds(3)). It has the mode and owner
  /// of its unit, and remains after this object. Otherwise makes a socket, replacing one of a dead daemon. Its path
  /// appears with the right mode, and only once connections are accepted. If several start at once, one gets the path.
  /// @param mode  as for chmod
  /// @errors kInvalidArgument: longer than kMaxSocketPath; kBusy: a service runs there; kAlreadyExists: the path is
  ///         not a socket; kMismatch: systemd listens elsewhere; kNotFound: no such folder; kPermissionDenied;
  ///         kNoSpace; kIo
  [[nodiscard]] static Result<ListeningSocket> open(const std::filesystem::path& path, int mode);

  ListeningSocket(ListeningSocket&& other) noexcept = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ~ListeningSocket();

  /// Hands over the descriptor; this object still removes the path.
  [[nodiscard]] int release() { return socket_.release(); }

 private:
  ListeningSocket(FileDescriptor socket, std::filesystem::path path, ino_t inode)
      : socket_(std::move(socket)), path_(std::move(path)), inode_(inode) {}

  FileDescriptor socket_;
  std::filesystem::path path_;  ///< empty once moved from, or if the socket is systemd's
  ino_t inode_;                 ///< distinguishes our socket from another service's at the path, which must stay
};

/// Checks that a socket can be opened at the path, without opening one. @errors as ListeningSocket::open()
[[nodiscard]] Result<> check_socket_path(const std::filesystem::path& path);
/// The same for a service that starts: a socket that systemd hands over for the path is its own.
[[nodiscard]] Result<> check_can_listen(const std::filesystem::path& path);

}  // namespace slsd
