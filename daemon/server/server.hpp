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

/// Takes clients in and tells the subscribers among them of free scans.
/// @thread thread-bound to the event loop's, but for publish()
class Server {
 public:
  /// Called with the combined wishes of the subscribers; without a value if there are none.
  using DemandChanged = std::function<void(std::optional<FreeRun> demand)>;

  /// Carries a request out; answers through respond, now or later.
  using Handler = std::function<void(const Request&, Session&, Respond respond)>;

  Server(asio::io_context& events, const ServerOptions& options, Handler handler, DemandChanged demand_changed);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens; the socket appears. @errors of ListeningSocket::open()
  [[nodiscard]] Result<> open();
  /// Takes no more clients, and no more requests of those that are there; the socket disappears. Each client's
  /// connection ends when what is under way for it is sent.
  void wind_down();
  /// Tells whether a client took bytes of what is being sent to it since the time.
  [[nodiscard]] bool is_sending_since(std::chrono::steady_clock::time_point time) const;
  /// Hangs up on everyone.
  void end_all();

  [[nodiscard]] std::size_t clients() const { return sessions_.size(); }
  [[nodiscard]] std::size_t subscribers() const;
  /// The number of clients dropped because they read too slowly.
  [[nodiscard]] std::uint64_t dropped() const { return room_->traffic.dropped; }
  [[nodiscard]] const Traffic& traffic() const { return room_->traffic; }
  [[nodiscard]] const MemoryBudget& memory() const { return room_->memory; }
  /// Recomputes the demand. Call it when a session's subscription changed.
  void update_demand();

  /// Hands a free scan over; of those that the event loop did not get to yet the oldest are lost, and counted.
  /// @thread thread-safe
  void publish(FreeScan scan);
  /// Called with each free scan that was handed to the subscribers' sockets. Set before the first.
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
