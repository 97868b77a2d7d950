// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>

#include "daemon/scan/cloud_files.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// What goes to a client in one piece: a line, the bytes that follow it, and a descriptor that comes with the line.
struct Outgoing {
  enum class Kind { kReply, kEvent };
  Kind kind = Kind::kReply;
  std::string line;
  SharedBytes bytes;          ///< null: none
  FileDescriptor descriptor;  ///< sent with the line's first byte

  [[nodiscard]] std::size_t size() const { return line.size() + (bytes ? bytes->size() : 0); }
};

}  // namespace slsd
