// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/message.hpp"

#include "core/printable.hpp"

namespace slsd {

using nlohmann::json;

namespace {

// JSON-RPC leaves -32000 to -32099 to servers. Numbers never change, nor does the order of the codes: other programs
// compare them.
constexpr int kFirstOfOurs = -32001;
static_assert(static_cast<int>(ErrorCode::kInvalidArgument) == 0 && static_cast<int>(ErrorCode::kFrameSkewed) == 18);

constexpr std::size_t kMaxMessageBytes = 1500;
constexpr std::size_t kMaxWhereBytes = 300;

}  // namespace

int rpc_code(ErrorCode code) {
  return kFirstOfOurs - static_cast<int>(code);
}

// A message may quote a client, a device or a file; the code that quotes should shorten it. This limit is for code that
// forgot.
json RpcError::to_json() const {
  const std::string place = printable(where, kMaxWhereBytes);
  const std::string text = printable(message, kMaxMessageBytes);
  json data{{"name", name}};
  if (!place.empty()) data["where"] = place;
  return {{"code", code}, {"message", place.empty() ? text : place + ": " + text}, {"data", std::move(data)}};
}

RpcError parse_error(std::string message) {
  return {-32700, "parse_error", std::move(message), {}};
}

RpcError invalid_request(std::string message) {
  return {-32600, "invalid_request", std::move(message), {}};
}

RpcError method_not_found(std::string message) {
  return {-32601, "method_not_found", std::move(message), {}};
}

RpcError invalid_params(std::string message) {
  return {-32602, "invalid_params", std::move(message), {}};
}

RpcError rpc_error(const Error& error) {
  return {rpc_code(error.code), std::string(to_string(error.code)), error.message, error.where};
}

std::string to_line(const json& message) {
  return message.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
}

json result_message(const json& id, json result) {
  return {{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}};
}

json error_message(const json& id, const RpcError& error) {
  return {{"jsonrpc", "2.0"}, {"id", id}, {"error", error.to_json()}};
}

json event_message(std::string_view method, json params) {
  return {{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}};
}

json request_message(std::int64_t id, std::string_view method, json params) {
  return {{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", std::move(params)}};
}

}  // namespace slsd
