// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/rpc/rpc_error.hpp"

namespace slsd {
namespace {

// JSON-RPC leaves -32000 to -32099 to servers. Numbers stay for good, as the order of the codes does: programs outside
// compare them.
constexpr int kFirstOfOurs = -32001;
static_assert(static_cast<int>(ErrorCode::kInvalidArgument) == 0 && static_cast<int>(ErrorCode::kFrameSkewed) == 18);

}  // namespace

int rpc_code(ErrorCode code) {
  return kFirstOfOurs - static_cast<int>(code);
}

nlohmann::json RpcError::to_json() const {
  nlohmann::json data{{"name", name}};
  if (!where.empty()) data["where"] = where;
  return {{"code", code}, {"message", where.empty() ? message : where + ": " + message}, {"data", std::move(data)}};
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

}  // namespace slsd
