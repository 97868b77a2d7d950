// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <tl/expected.hpp>

namespace slsd::web {

inline constexpr std::size_t kHeadBytesMax = 16 << 10;
inline constexpr std::size_t kRequestLineBytesMax = 8 << 10;

/// The refusal of a request, with its cause.
struct Refusal {
  int status;  ///< HTTP's status
  std::string name;
  std::string message;  ///< the remedy
};

/// A request with unambiguous framing.
struct Request {
  std::string method;
  std::string path;  ///< the sent path without the query; begins with '/'
  std::map<std::string, std::string> query;
  std::string host, origin, cookie, authorization;  ///< headers; empty: none
  std::string site, destination;                    ///< headers Sec-Fetch-Site and Sec-Fetch-Dest
  std::string page_key;                             ///< header X-Slsd-Page
  bool by_https = false;                            ///< according to a proxy
  bool keep_alive = false;
  bool expects_continue = false;
  std::size_t body_bytes = 0;
  std::string body;
  std::string address;        ///< the client's address
  std::string local_address;  ///< this machine's address that received the request
};

/// The end of a head, or the reason why the head is invalid.
struct HeadEnd {
  std::size_t bytes = 0;  ///< length with the empty line; 0: incomplete
  std::optional<Refusal> refusal;
};

/// Searches for the end of a head in the received data. Immediately refuses control characters, line ends other than CR
/// LF, folded lines and a head that is too long.
/// @thread reentrant
[[nodiscard]] HeadEnd find_head_end(std::string_view received);

/// Parses a request line and its headers. Refuses everything that two programs may interpret differently: requires one
/// Host, at most one Content-Length with one number, no Transfer-Encoding, and no body if the method has none (RFC
/// 9112, 6.3 and 11.2).
/// @param head  of the length from find_head_end()
/// @thread reentrant
[[nodiscard]] tl::expected<Request, Refusal> read_head(std::string_view head);

/// Refuses a query with a parameter that is not among the known ones, and names the nearest of these.
/// @thread reentrant
[[nodiscard]] std::optional<Refusal> unknown_parameter(const std::map<std::string, std::string>& query,
                                                       const std::vector<std::string>& known);
/// The same for the object in a request's body.
[[nodiscard]] std::optional<Refusal> unknown_parameter(const nlohmann::json& body,
                                                       const std::vector<std::string>& known);

}  // namespace slsd::web
