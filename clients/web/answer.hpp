// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <slsd/connection.hpp>

#include "clients/web/request.hpp"

namespace slsd::web {

/// The reply to a request.
struct Answer {
  int status = 200;
  std::string type;                                          ///< the body's type; empty: no body
  client::Bytes body;                                        ///< sent in pieces of 1 MiB
  std::vector<std::pair<std::string, std::string>> headers;  ///< in addition to those of every answer
  std::function<void(std::string_view)> on_sent;             ///< called when a piece has been sent; may be empty
};

/// A refusal in the page's format.
[[nodiscard]] Answer answer_of(const Refusal& refusal);

/// The server's callbacks to the page.
struct Handlers {
  /// Judges a request by its head alone, before its body is read. @return the refusal, if any. @thread that of run()
  std::function<std::optional<Answer>(const Request&)> refuse;
  /// Answers an admitted request; may block. @thread one of many
  std::function<Answer(const Request&)> answer;
  std::vector<std::pair<std::string, std::string>> headers;  ///< sent with every answer
  std::size_t body_bytes_max;
};

}  // namespace slsd::web
