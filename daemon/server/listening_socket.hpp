// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "core/result.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// A Unix stream socket at a path, which is removed again by the destructor.
/// @thread thread-bound
class ListeningSocket {
 public:
  /// Listens at the path, by the socket that systemd hands over where it does (sd_listen_fds(3)): that has its unit's
  /// mode and owner, and stays when this object goes. Else by one of its own: the socket of a daemon that is dead is
  /// replaced. The socket appears at the path with its mode, and only once connections are taken.
  /// @param mode  as for chmod
  /// @errors kInvalidArgument: longer than kMaxSocketPath; kBusy: a daemon answers there; kAlreadyExists: something
  ///         that is no socket is there; kMismatch: systemd listens elsewhere; kNotFound: no such folder;
  ///         kPermissionDenied; kNoSpace; kIo
  [[nodiscard]] static Result<ListeningSocket> open(const std::filesystem::path& path, int mode);

  ListeningSocket(ListeningSocket&& other) noexcept = default;
  ListeningSocket& operator=(ListeningSocket&&) = delete;
  ~ListeningSocket();

  /// The descriptor, handed over; the path stays this object's to remove.
  [[nodiscard]] int release() { return socket_.release(); }

 private:
  ListeningSocket(FileDescriptor socket, std::filesystem::path path, ino_t inode)
      : socket_(std::move(socket)), path_(std::move(path)), inode_(inode) {}

  FileDescriptor socket_;
  std::filesystem::path path_;  ///< empty once moved from, and where it is systemd's
  ino_t inode_;                 ///< tells our socket from another daemon's at the path, which is left alone
};

/// Checks that a socket can be opened at the path; opens none. @errors as ListeningSocket::open()
[[nodiscard]] Result<> check_socket_path(const std::filesystem::path& path);

}  // namespace slsd
