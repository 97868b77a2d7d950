// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// The watch for a camera's packets that arrive in pieces (IP fragments), because they are larger than the way to this
/// host lets through. A packet socket sees no such packet whole, and without one a frame is lost with any of its
/// pieces.
/// @thread thread-bound
class FragmentWatch {
 public:
  /// Watches nothing and sees no fragments.
  FragmentWatch() = default;
  /// Watches the camera's packets from now on. Without CAP_NET_RAW it sees no fragments.
  explicit FragmentWatch(in_addr camera);

  [[nodiscard]] bool seen();

 private:
  FileDescriptor socket_;
  bool seen_ = false;
};

}  // namespace slsd
