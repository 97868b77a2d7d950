// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>

#include "clients/tcp/relay.hpp"
#include "core/result.hpp"

namespace slsd::tcp {

/// Listens for TCP clients, each with a relay of its own, all in one thread.
/// @thread thread-bound
class TcpServer {
 public:
  TcpServer(TcpOptions options, Token token) : room_(events_, std::move(options), std::move(token)) {}

  /// @errors kInvalidArgument: not an address; kIo: cannot listen there
  [[nodiscard]] Result<> open();
  [[nodiscard]] int port() const;
  /// Serves until SIGINT or SIGTERM.
  void run();
  /// @thread thread-safe
  void stop() { events_.stop(); }

 private:
  void accept();
  void pause();

  asio::io_context events_{1};
  RelayRoom room_;
  asio::ip::tcp::acceptor acceptor_{events_};
  asio::steady_timer pause_{events_};
};

}  // namespace slsd::tcp
