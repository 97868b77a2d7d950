// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "daemon/rpc/message.hpp"

namespace slsd {

/// Deeper JSON, and more of it, is refused before it is parsed: a line's cost is its length, whatever it says.
inline constexpr int kMaxNesting = 32;
inline constexpr int kMaxValues = 1000;

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

/// The cost of reading a JSON text: the depth of its nested objects and arrays, and an upper bound on its values.
/// Brackets and commas within texts do not count. Counting stops at a limit that is exceeded.
struct JsonShape {
  int depth = 0;
  int values = 1;
  bool closed = true;  ///< each text and bracket that is opened
};
[[nodiscard]] JsonShape shape_of(std::string_view json);

}  // namespace slsd
