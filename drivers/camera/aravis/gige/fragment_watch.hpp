// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>

#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// Detects that a camera's packets arrive as IP fragments, because they are too large for the route to this host. A
/// packet socket never sees such a packet whole. A UDP socket loses a frame with any one of its fragments.
/// @thread thread-bound
class FragmentWatch {
 public:
  /// Watches nothing and never sees fragments.
  FragmentWatch() = default;
  /// Watches the camera's packets from now on. Sees no fragments without CAP_NET_RAW.
  explicit FragmentWatch(in_addr camera);

  [[nodiscard]] bool seen();

 private:
  FileDescriptor socket_;
  bool seen_ = false;
};

}  // namespace slsd
