// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>

#include "clients/access/token.hpp"
#include "clients/tcp/address_range.hpp"
#include "clients/tcp/request_lines.hpp"

namespace slsd::tcp {

struct TcpOptions {
  std::filesystem::path socket;  ///< the service's
  std::string listen = "127.0.0.1";
  int port = 8385;
  std::vector<AddressRange> allow = {};  ///< whom it serves
  int clients_max = 8;
  std::chrono::milliseconds token_timeout = std::chrono::seconds(5);    ///< from connecting to the token's line
  std::chrono::milliseconds send_timeout = std::chrono::seconds(10);    ///< for each 64 kB
  std::chrono::milliseconds parting_timeout = std::chrono::seconds(2);  ///< for the client to read its last answer
};

/// The state that all relays share. @thread that of its io_context
struct RelayRoom {
  RelayRoom(asio::io_context& io, TcpOptions given, Token token)
      : events(io), options(std::move(given)), tokens(std::move(token)) {}

  asio::io_context& events;
  TcpOptions options;
  TokenCheck tokens;
  int clients = 0;                       ///< with the right token
  int parting = 0;                       ///< that read their last answer
  std::map<std::string, int> strangers;  ///< without a token yet, by address

  /// Tells the log about a refusal, at most once a second, so that nobody can fill it.
  void note_refusal(const std::string& address, const std::string& why);

 private:
  std::chrono::steady_clock::time_point noted_{};
  int not_noted_ = 0;
};

/// One TCP client, and its connection to the service:
///
///     stranger --the right token--> client --the service or the client hangs up--> parting, 2 s
///         |                                                                           ^
///         +--refused, with one error--------------------------------------------------+
///
/// It holds at most one line of requests and 64 kB of answers. While the client does not read, nothing is read from the
/// service, which then treats the client as slow; after ten seconds the relay ends.
/// @thread thread-bound to the event loop's
class Relay : public std::enable_shared_from_this<Relay> {  // shared: pending reads and writes own it
 public:
  Relay(RelayRoom& room, asio::ip::tcp::socket peer);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  void start();

 private:
  enum class Phase { kNew, kStranger, kClient, kParting };
  void enter(Phase phase);
  void read_peer();
  void on_received(std::size_t bytes);
  void on_peer_ended();
  void read_greeting();
  void judge_greeting(std::string_view line);
  void admit(const Greeting& greeting);
  void connect(const Greeting& greeting);
  [[nodiscard]] std::error_code connect_to_service();
  void pass_on();
  void pass_rest_on();
  void read_service();
  void send_answer(std::size_t bytes);
  void refuse(const nlohmann::json& id, const RpcError& error);
  void part();
  void close();
  void clear_deadline();
  void set_deadline(std::chrono::milliseconds after, void (Relay::*then)());

  RelayRoom& room_;
  asio::ip::tcp::socket peer_;
  asio::local::stream_protocol::socket service_;
  asio::steady_timer deadline_;
  std::string address_;
  RequestLines requests_;
  std::array<char, 65536> from_peer_{};
  std::array<char, 65536> from_service_{};
  std::string to_service_;
  std::string to_peer_;  ///< one line of the relay's own
  std::size_t thrown_away_ = 0;
  Phase phase_ = Phase::kNew;
  bool reading_ = false;     ///< a read from the peer is pending
  bool peer_ended_ = false;  ///< the peer sends no more
};

}  // namespace slsd::tcp
