// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>

#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// Bytes that may go to several clients, which send them at their own pace: hence shared.
using SharedBytes = std::shared_ptr<const std::string>;

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
