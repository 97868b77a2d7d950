// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include <asio/post.hpp>
#include <nlohmann/json.hpp>

#include "daemon/server/reply.hpp"
#include "daemon/server/service_state.hpp"
#include "rpc/message.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {

[[nodiscard]] inline MonotonicTime deadline_in(int timeout_ms) {
  return std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
}

/// The parameter timeout_ms; without it, the configured one.
[[nodiscard]] inline int read_timeout(ParamReader& reader, const ServiceState& state) {
  return reader.integer("timeout_ms", state.configuration.scan.timeout_ms, 1, kMaxTimeoutMs);
}

[[nodiscard]] inline SharedBytes share(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

/// A reply with bytes after it.
[[nodiscard]] inline Outcome bytes_reply(std::string bytes, nlohmann::json result) {
  Reply reply{std::move(result)};
  reply.result["bytes"] = bytes.size();
  reply.bytes = share(std::move(bytes));
  return reply;
}

/// Makes an answer into a reply on the scanner's thread and carries it to the event loop's thread.
template <class Value, class MakeReply>
Scanner::Answer<Value> carry(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&events = state.events, respond = std::move(respond), make_reply](Result<Value> value) {
    auto outcome = std::make_shared<Outcome>(value ? make_reply(*value) : tl::unexpected(rpc_error(value.error())));
    asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
  };
}

}  // namespace slsd
