// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>

#include "daemon/configuration/server_options.hpp"
#include "daemon/rpc/line_buffer.hpp"
#include "daemon/rpc/request.hpp"
#include "daemon/server/reply.hpp"
#include "daemon/server/subscription.hpp"

namespace slsd {

/// One client. Requests are answered one after the other: the next is read when the reply to the one before is sent, so
/// that what waits for a client is at most one reply, one event and what its subscription holds.
///
///     reading --a line--> answering --reply sent--> reading
///     any --the client hung up, read nothing for send_timeout, sent too long a line--> ended
///
/// @thread thread-bound
class Session : public std::enable_shared_from_this<Session> {  // shared with the operations under way
 public:
  using Socket = asio::local::stream_protocol::socket;
  /// Carries a request out; answers through respond, now or later.
  using Handler = std::function<void(const Request&, Session&, Respond respond)>;
  using Ended = std::function<void(Session&)>;

  Session(Socket socket, const ServerOptions& options, const Handler& handler, Ended ended);

  void start() { read(); }
  /// Reads no further request; the connection ends when all that is under way is sent.
  void wind_down() { last_reply_ = true; }
  void end();

  void subscribe(const Subscription& subscription) { subscription_ = subscription; }
  void unsubscribe() { subscription_.reset(); }
  [[nodiscard]] const std::optional<Subscription>& subscription() const { return subscription_; }
  /// A free scan's outcome, for those who subscribed.
  void publish(const SharedPublication& publication, std::uint64_t lost);

 private:
  void read();
  void on_read(const std::error_code& error, std::size_t size);
  void next_request();
  void answer(const std::string& line);
  void refuse(const nlohmann::json& id, const RpcError& error);
  void reply(const nlohmann::json& id, bool wanted, Outcome outcome);
  void on_answered();
  void send(Outgoing outgoing);
  void send_waiting_event();
  void write();
  void write_with_descriptor();
  void on_written(const std::error_code& error, std::size_t size);
  void watch_progress();

  Socket socket_;
  const ServerOptions& options_;
  const Handler& handler_;
  Ended ended_;
  asio::steady_timer progress_;
  std::array<char, 16384> chunk_{};
  LineBuffer lines_;
  std::deque<Outgoing> outgoing_;
  std::size_t sent_ = 0;  ///< bytes of the first outgoing
  std::optional<Subscription> subscription_;
  bool answering_ = false;
  bool hung_up_ = false;     ///< the client sends no more
  bool last_reply_ = false;  ///< the connection ends when all is sent
  bool over_ = false;
};

}  // namespace slsd
