// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "core/result.hpp"

namespace slsd {

/// The error sent to a client whose request failed. The codes are JSON-RPC's, and our own from -32001 down;
/// docs/protocol.md lists them.
struct RpcError {
  int code;
  std::string name;     ///< "frame_stale": for programs to compare
  std::string message;  ///< the cause and the remedy
  std::string where;    ///< file:line:column, key, device, or empty

  /// Printable, and at most about 2 kB, whatever the error quotes.
  [[nodiscard]] nlohmann::json to_json() const;
};

/// The number of the code for clients: -32001 to -32019.
[[nodiscard]] int rpc_code(ErrorCode code);

[[nodiscard]] RpcError parse_error(std::string message);
[[nodiscard]] RpcError invalid_request(std::string message);
[[nodiscard]] RpcError method_not_found(std::string message);
[[nodiscard]] RpcError invalid_params(std::string message);
[[nodiscard]] RpcError rpc_error(const Error& error);

/// Writes one JSON object and a line feed. Invalid UTF-8 (a file's name may be any bytes) becomes replacement
/// characters.
[[nodiscard]] std::string to_line(const nlohmann::json& message);

[[nodiscard]] nlohmann::json result_message(const nlohmann::json& id, nlohmann::json result);
[[nodiscard]] nlohmann::json error_message(const nlohmann::json& id, const RpcError& error);
[[nodiscard]] nlohmann::json event_message(std::string_view method, nlohmann::json params);
[[nodiscard]] nlohmann::json request_message(std::int64_t id, std::string_view method, nlohmann::json params);

}  // namespace slsd
