// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "daemon/scan/cloud/cloud_files.hpp"
#include "daemon/server/lent_memory.hpp"
#include "rpc/message.hpp"

namespace slsd {

/// One piece of output to a client: a line, the bytes that follow it, and the descriptor sent with it.
struct Outgoing {
  enum class Kind { kReply, kEvent };
  Kind kind = Kind::kReply;
  std::string line;
  SharedBytes bytes;          ///< null: none
  FileDescriptor descriptor;  ///< sent with the line's first byte
  FileDescriptor kept;        ///< the second descriptor of a SealedMemory, which counts it as lent
  std::size_t lent_bytes = 0;

  [[nodiscard]] std::size_t size() const { return line.size() + (bytes ? bytes->size() : 0); }
};

/// The outcome of a method: its result, the bytes or memfd that follow the reply, and the events sent before it.
struct Reply {
  nlohmann::json result;
  SharedBytes bytes = nullptr;
  std::optional<SealedMemory> memory = {};
  std::vector<Outgoing> first = {};
};

using Outcome = tl::expected<Reply, RpcError>;

/// Answers one request: called once, on the main thread. Does nothing if the client is gone.
using Respond = std::function<void(Outcome)>;

}  // namespace slsd
