// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <slsd/connection.hpp>

#include "clients/web/request.hpp"
#include "core/result.hpp"

namespace slsd::web {

/// The reply to a request.
struct Answer {
  int status = 200;
  std::string type;                                          ///< of the body; empty: no body
  client::Bytes body;                                        ///< sent in pieces of 1 MiB
  std::vector<std::pair<std::string, std::string>> headers;  ///< beside those that every answer has
  std::function<void(std::string_view)> on_sent;             ///< of each piece, when it is sent; may be empty
};

/// A refusal as the page reads it.
[[nodiscard]] Answer answer_of(const Refusal& refusal);

/// Callbacks by which the server asks the page behind it.
struct Handlers {
  /// Judges a request by its head alone, before its body is read. @return the refusal, if any. @thread that of run()
  std::function<std::optional<Answer>(const Request&)> refuse;
  /// Answers an admitted request; may block. @thread one of many
  std::function<Answer(const Request&)> answer;
  std::vector<std::pair<std::string, std::string>> headers;  ///< of every answer
  std::size_t body_bytes_max;
};

/// HTTP/1.1 over Boost.Asio and Boost.Beast.
///
///     idle --first byte--> a request, whole within 5 s --> answered --> idle, 5 s
///                                     |
///                                     +--> refused: what is left unread is thrown away, and the connection closed
///
/// If many connections have no whole request, each has less time. A piece of an answer has to be taken within ten
/// seconds. Slow peers hold no thread.
class HttpServer {
 public:
  virtual ~HttpServer() = default;

  /// @param address  a number, or a name of this machine
  /// @param port     0: any that is free
  /// @errors kIo: cannot listen there, with who has the port if that can be seen
  [[nodiscard]] static Result<std::unique_ptr<HttpServer>> open(const std::string& address, int port,
                                                                Handlers handlers);
  [[nodiscard]] virtual int port() const = 0;
  /// Serves until SIGINT or SIGTERM. @param at_end  is called before the signal ends the program
  virtual void run(const std::function<void()>& at_end) = 0;
};

}  // namespace slsd::web
