// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "daemon/rpc/rpc_error.hpp"

namespace slsd {

/// Deeper JSON is refused before it is parsed.
inline constexpr int kMaxNesting = 32;

/// A JSON-RPC 2.0 request.
struct Request {
  nlohmann::json id;  ///< null, a number or a text
  bool wants_reply;   ///< false for a notification, which has no id
  std::string method;
  nlohmann::json params;  ///< an object, empty where the request had none
};

/// A line that is no request, and the id that the error goes to: null where none could be read.
struct BadRequest {
  nlohmann::json id;
  RpcError error;
};

/// Reads one line, without its line feed. Any bytes at all.
/// @thread reentrant
[[nodiscard]] tl::expected<Request, BadRequest> parse_request(std::string_view line);

/// How deep objects and arrays are nested in a JSON text; brackets within texts do not count.
[[nodiscard]] int nesting_depth(std::string_view json);

}  // namespace slsd
