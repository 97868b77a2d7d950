// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace slsd {

/// Owns a file descriptor of a file, a socket, a device or an event; or none.
/// @thread thread-bound
class FileDescriptor {
 public:
  FileDescriptor() = default;
  /// @param number  a result of open(), socket() and the like: negative if they failed
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(other.release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) {
      static_cast<void>(close());
      number_ = other.release();
    }
    return *this;
  }
  ~FileDescriptor() { static_cast<void>(close()); }

  [[nodiscard]] explicit operator bool() const { return number_ >= 0; }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] int release() { return std::exchange(number_, -1); }

  /// Returns zero or errno: a network file system may report a full disk only here. Preserves errno, so that a
  /// destructor does not hide why a call failed.
  [[nodiscard]] int close() {
    const int number = release();
    if (number < 0) return 0;
    const int before = errno;
    return ::close(number) == 0 ? 0 : std::exchange(errno, before);
  }

 private:
  int number_ = -1;
};

}  // namespace slsd
