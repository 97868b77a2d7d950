// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>

#include "daemon/configuration/access.hpp"
#include "daemon/configuration/server_options.hpp"
#include "daemon/server/lent_memory.hpp"
#include "daemon/server/memory_budget.hpp"
#include "daemon/server/reply.hpp"
#include "daemon/server/subscription.hpp"
#include "daemon/server/turns.hpp"
#include "rpc/line_buffer.hpp"
#include "rpc/request.hpp"

namespace slsd {

class Session;

/// The traffic between a server and all its clients so far.
struct Traffic {
  std::uint64_t accepted = 0;     ///< clients
  std::uint64_t refused = 0;      ///< connections refused because places or the role were missing
  std::uint64_t dropped = 0;      ///< clients dropped because they read too slowly
  std::uint64_t clouds_lost = 0;  ///< clouds lost because a subscriber read too slowly
  std::uint64_t bytes_received = 0;
  std::uint64_t bytes_sent = 0;
};

/// The state that the sessions of a server share.
struct SessionRoom {
  SessionRoom(asio::io_context& events, const ServerOptions& server_options)
      : options(server_options),
        access(AccessRules::of(options).value_or(AccessRules())),
        memory(server_options.memory_max_bytes()),
        lent(memory),
        turns(events) {}

  ServerOptions options;
  AccessRules access;
  MemoryBudget memory;
  LentMemory lent;
  Turns turns;
  std::array<char, 65536> chunk{};  ///< input of the session whose turn it is
  Traffic traffic;
  /// Carries out a request; answers through respond, now or later.
  std::function<void(const Request&, Session&, Respond respond)> handler = {};
  std::function<void(Session&, bool subscribed)> ended = {};
};

/// One client. Requests are answered one at a time: the next is read when the previous reply is sent. So at most one
/// reply, one event and the subscription's clouds wait for a client.
///
///     request   none --a line--> under way --respond()--> being sent --all of it sent--> none
///     input     open --shutdown(SHUT_WR)--> ended --the last line was read--> shut
///               open --a line too long, wind_down()-----------------------> shut
///
/// Events go out before, between and after replies. The connection ends when the client has shut its output, no request
/// is under way and all is sent. But a subscriber that shut only its output still gets its events. The connection ends
/// at once if the client reads too slowly, or is gone.
///
/// A client is gone when it closed its socket or shut down both directions. That is detected during a request too:
/// gone() is requested, and nobody waits for the reply. Earlier requests without an id are still carried out.
///
/// @thread thread-bound
class Session : public std::enable_shared_from_this<Session> {  // shared with the operations under way
 public:
  using Socket = asio::local::stream_protocol::socket;

  Session(Socket socket, std::shared_ptr<SessionRoom> room);

  [[nodiscard]] const Peer& peer() const { return peer_; }
  [[nodiscard]] Role role() const { return role_; }
  /// Tells whether this is the client's first refusal: only that one is logged.
  [[nodiscard]] bool is_first_refusal() { return !std::exchange(refused_, true); }
  [[nodiscard]] const std::string& way_to(Role role) const { return room_.access.way_to(role); }

  void start();
  /// Accepts no more requests, and ends when all work under way is sent.
  void wind_down();
  void end();

  /// Reserves memory for the result of the request under way, before it is made.
  /// @return  the error to answer with if too little is free
  [[nodiscard]] std::optional<RpcError> reserve(std::size_t bytes);
  /// Requested when nobody waits for the current request's outcome any more; never for a request without an id.
  [[nodiscard]] std::stop_token gone() const { return wanted_ ? gone_.get_token() : std::stop_token(); }

  void subscribe(const Subscription& subscription) { subscription_ = subscription; }
  void unsubscribe() {
    subscription_.reset();
    memory_.release(MemoryAccount::Part::kWaiting);
  }
  [[nodiscard]] const std::optional<Subscription>& subscription() const { return subscription_; }
  /// Sends a free scan's outcome if the client subscribed.
  void publish(const SharedPublication& publication, std::uint64_t lost);

  /// Tells whether a message is being sent, and the client has read bytes of it since the time.
  [[nodiscard]] bool is_sending_since(std::chrono::steady_clock::time_point time) const;

 private:
  enum class Input { kOpen, kEnded, kShut };
  void ask_turn();
  void take_turn();
  [[nodiscard]] std::optional<std::string_view> next_line();
  [[nodiscard]] bool receive();
  void await_input();
  void await_hang_up();
  void on_hang_up();
  void answer(std::string_view line);
  void refuse(const nlohmann::json& id, const RpcError& error);
  void reply(std::uint64_t number, Outcome outcome);
  void on_answered();
  void end_where_done();
  void send(Outgoing outgoing);
  void weigh_waiting();
  void send_waiting_event();
  void write();
  void withhold_descriptor();
  void finish_message();
  void watch_progress();
  void drop();

  Socket socket_;
  std::shared_ptr<SessionRoom> shared_room_;  // operations under way outlive the server
  SessionRoom& room_;
  Peer peer_;
  Role role_;
  bool refused_ = false;
  Turns::Taker taker_;
  MemoryAccount memory_;
  asio::steady_timer progress_;
  asio::steady_timer glance_;
  LineBuffer lines_;
  Input input_ = Input::kOpen;
  std::stop_source gone_;
  bool answering_ = false;  ///< true from a request's line to the last byte of its reply
  bool wanted_ = false;     ///< the request expects a reply
  nlohmann::json id_;       ///< id of the request under way
  std::uint64_t number_ = 0;
  bool in_turn_ = false;
  std::deque<Outgoing> outgoing_;
  bool writing_ = false;   ///< or waiting until more can be sent
  std::size_t sent_ = 0;   ///< bytes sent of the first outgoing message
  std::size_t timed_ = 0;  ///< bytes sent when the timer was set
  bool timing_ = false;
  std::chrono::steady_clock::time_point sent_at_{};
  std::optional<Subscription> subscription_;
  bool closing_ = false;  ///< set for a subscriber too, once all is sent
  bool over_ = false;
};

}  // namespace slsd
