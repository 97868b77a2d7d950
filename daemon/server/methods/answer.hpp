// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include <asio/post.hpp>
#include <nlohmann/json.hpp>

#include "daemon/scan/within_memory.hpp"
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

/// Makes a value into a reply, or its error, or that of missing memory.
template <class Value, class MakeReply>
std::shared_ptr<Outcome> outcome_of(const Result<Value>& value, const MakeReply& make_reply) {
  auto outcome = std::make_shared<Outcome>();
  within_memory([&] { *outcome = value ? make_reply(*value) : tl::unexpected(rpc_error(value.error())); },
                [&] { *outcome = tl::unexpected(rpc_error(out_of_memory())); });
  return outcome;
}

/// Makes an answer into a reply on the scanner's thread and carries it to the event loop's thread.
template <class Value, class MakeReply>
Scanner::Answer<Value> carry(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&events = state.events, respond = std::move(respond), make_reply](Result<Value> value) {
    const auto outcome = outcome_of(value, make_reply);
    asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
  };
}

}  // namespace slsd
