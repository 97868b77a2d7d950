// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "rpc/line_buffer.hpp"
#include "rpc/request.hpp"

namespace slsd::tcp {

/// The first line of a client, with its token.
struct Greeting {
  nlohmann::json id;
  bool wants_reply;
  std::string token;
};

/// The longest first line.
inline constexpr std::size_t kGreetingBytesMax = 4096;

/// Reads `{"jsonrpc": "2.0", "id": 1, "method": "authenticate", "params": {"token": "..."}}`.
/// @param line  any bytes, without the line feed
/// @thread reentrant
[[nodiscard]] tl::expected<Greeting, BadRequest> read_greeting(std::string_view line);

/// Splits what a client sends into requests, and asks for clouds inline instead of as memfds, which TCP cannot carry.
/// Everything else passes unchanged, so that the service answers as it does on its own socket.
/// @thread thread-bound
class RequestLines {
 public:
  /// A longer line passes as it comes.
  static constexpr std::size_t kLineBytesMax = 1 << 20;

  RequestLines() : lines_(kLineBytesMax) {}

  void append(std::string_view bytes);
  /// The first line, if it is complete. Call it before take(). Valid until the next call.
  [[nodiscard]] std::optional<std::string_view> first_line() { return lines_.next_line(); }
  /// Takes what can be passed on now: whole lines, and pieces of longer ones.
  [[nodiscard]] std::string take();
  /// Bytes that wait for the end of their line, unchanged.
  [[nodiscard]] std::string take_held();
  /// The same as a request, with a line feed.
  [[nodiscard]] std::string take_rest();
  /// The number of bytes that wait for the end of their line.
  [[nodiscard]] std::size_t size() const { return lines_.size(); }

 private:
  LineBuffer lines_;
  std::string passing_;  ///< bytes of a line that is too long to hold
  bool in_long_line_ = false;
};

}  // namespace slsd::tcp
