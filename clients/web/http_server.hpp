// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "clients/web/answer.hpp"
#include "core/result.hpp"

namespace slsd::web {

/// HTTP/1.1 over Boost.Asio and Boost.Beast.
///
///     idle --first byte--> a request, whole within 5 s --> answered --> idle, 5 s
///                                     |
///                                     +--> refused: what is left unread is thrown away, and the connection closed
///
/// If many connections have no whole request, each gets less time. The peer must accept each piece of an answer within
/// ten seconds. Slow peers occupy no thread.
class HttpServer {
 public:
  virtual ~HttpServer() = default;

  /// @param address  an address, or a name of this machine
  /// @param port     0: any free port
  /// @errors kIo: cannot listen there; names the program at the port if visible
  [[nodiscard]] static Result<std::unique_ptr<HttpServer>> open(const std::string& address, int port,
                                                                Handlers handlers);
  [[nodiscard]] virtual int port() const = 0;
  /// Serves until SIGINT or SIGTERM. @param at_end  called before the signal ends the program
  virtual void run(const std::function<void()>& at_end) = 0;
};

}  // namespace slsd::web
