// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "rpc/message.hpp"

namespace slsd {

/// Limits JSON before it is parsed, so that a line costs no more than its length, whatever it contains.
inline constexpr int kMaxNesting = 32;
inline constexpr int kMaxValues = 1000;

/// A JSON-RPC 2.0 request.
struct Request {
  nlohmann::json id;  ///< null, a number or a text
  bool wants_reply;   ///< false for a notification, which has no id
  std::string method;
  nlohmann::json params;  ///< an object; empty if the request had none
};

/// An invalid line, and the id for the error: null if it has no readable id.
struct BadRequest {
  nlohmann::json id;
  RpcError error;
};

/// A JSON text, and the first name that one of its objects has twice. Which of the two counts would be a guess.
struct ParsedJson {
  nlohmann::json value;  ///< discarded if the text is not JSON
  std::optional<std::string> repeated;
};
/// @param text  any bytes
/// @thread reentrant
[[nodiscard]] ParsedJson parse_json(std::string_view text);
/// Says so.
[[nodiscard]] std::string appears_twice(const std::string& name);

/// Reads one line without its line feed; it may contain any bytes.
/// @thread reentrant
[[nodiscard]] tl::expected<Request, BadRequest> parse_request(std::string_view line);

/// The cost of reading a JSON text: the depth of nested objects and arrays, and an upper bound on the number of values.
/// Ignores brackets and commas within texts. Counting stops when a limit is exceeded.
struct JsonShape {
  int depth = 0;
  int values = 1;
  bool closed = true;  ///< every text and bracket is closed
};
[[nodiscard]] JsonShape shape_of(std::string_view json);

}  // namespace slsd
