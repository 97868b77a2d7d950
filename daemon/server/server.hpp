// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_set>

#include <asio/io_context.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>

#include "core/result.hpp"
#include "daemon/configuration/server_options.hpp"
#include "daemon/server/listening_socket.hpp"
#include "daemon/server/session.hpp"

namespace slsd {

/// Accepts clients and sends free scans to the subscribers.
/// @thread thread-bound to the event loop's, except publish()
class Server {
 public:
  /// Called with the combined wishes of the subscribers; without a value if there are none.
  using DemandChanged = std::function<void(std::optional<FreeRun> demand)>;

  /// Carries out a request; answers through respond, now or later.
  using Handler = std::function<void(const Request&, Session&, Respond respond)>;

  Server(asio::io_context& events, const ServerOptions& options, Handler handler, DemandChanged demand_changed);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens; the socket appears. @errors of ListeningSocket::open()
  [[nodiscard]] Result<> open();
  /// Accepts no more clients, and no more requests from connected ones; the socket disappears. Each connection ends
  /// when the client's work under way is sent.
  void wind_down();
  /// Tells whether a client has read bytes since the time, while being sent more.
  [[nodiscard]] bool is_sending_since(std::chrono::steady_clock::time_point time) const;
  /// Ends all connections.
  void end_all();

  [[nodiscard]] std::size_t clients() const { return sessions_.size(); }
  [[nodiscard]] std::size_t subscribers() const;
  /// The number of clients dropped because they read too slowly.
  [[nodiscard]] std::uint64_t dropped() const { return room_->traffic.dropped; }
  [[nodiscard]] const Traffic& traffic() const { return room_->traffic; }
  [[nodiscard]] const MemoryBudget& memory() const { return room_->memory; }
  /// Recomputes the demand. Call it whenever a session's subscription changed.
  void update_demand();

  /// Hands over a free scan. If several wait for the event loop, the oldest are dropped and counted.
  /// @thread thread-safe
  void publish(FreeScan scan);
  /// Called with each free scan after it went to the subscribers' sockets. Set before the first scan.
  void set_delivered(std::function<void(const ScanResult&)> delivered) { delivered_ = std::move(delivered); }

 private:
  void accept();
  void on_accepted(const std::error_code& error, Session::Socket socket);
  static void turn_away(Session::Socket socket, const Error& error);
  [[nodiscard]] std::optional<Error> refuses(const Peer& peer) const;
  void retry_later(const std::error_code& error);
  void deliver();

  asio::io_context& events_;
  std::shared_ptr<SessionRoom> room_;  // shared with the sessions
  DemandChanged demand_changed_;
  std::function<void(const ScanResult&)> delivered_;
  asio::local::stream_protocol::acceptor acceptor_;
  asio::steady_timer retry_;
  bool retrying_ = false;
  std::optional<ListeningSocket> socket_;
  std::unordered_set<std::shared_ptr<Session>> sessions_;
  std::mutex mutex_;  ///< guards the two below
  std::deque<FreeScan> waiting_;
  std::uint64_t lost_ = 0;
};

}  // namespace slsd
