// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "daemon/rpc/rpc_error.hpp"
#include "daemon/server/outgoing.hpp"

namespace slsd {

/// What a method gives: its result, the bytes that follow the reply, a descriptor, and events that go out before it.
struct Reply {
  nlohmann::json result;
  SharedBytes bytes = nullptr;
  FileDescriptor descriptor = {};
  std::vector<Outgoing> first = {};
};

using Outcome = tl::expected<Reply, RpcError>;

/// Answers one request: called once, on the main thread. Where the client is gone it does nothing.
using Respond = std::function<void(Outcome)>;

}  // namespace slsd
