// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/tcp_stream.hpp>

#include "clients/web/answer.hpp"

namespace slsd::web {

/// The state that all connections of a server share. @thread that of its io_context, except the workers
struct Shared {
  Handlers handlers;
  boost::asio::io_context io{1};
  int open = 0;     ///< connections
  int waiting = 0;  ///< connections without a whole request
  std::function<void()> on_closed;
  boost::asio::thread_pool workers;
};

/// One peer: reads a request, answers it, and reads the next.
/// @thread that of the io_context
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {  // shared: pending reads and writes own it
 public:
  HttpConnection(Shared& shared, boost::asio::ip::tcp::socket socket);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void wait_for_request();

 private:
  template <class Then>
  void read_more(Then then);
  void read_head();
  void admit();
  void read_body();
  void have_answered();
  void refuse(const Refusal& refusal, bool head_is_whole);
  void send(Answer answer, bool close);
  void send_body(std::size_t from);
  void finish();
  void throw_away();
  void set_waiting(bool waiting);
  [[nodiscard]] std::string head_of(const Answer& answer) const;

  Shared& shared_;
  boost::beast::tcp_stream stream_;
  std::array<char, 4096> piece_{};
  std::string received_;  ///< but not parsed yet
  Request request_;
  Answer answer_;
  std::string head_;  ///< the head of the answer
  int served_ = 0;
  std::size_t thrown_away_ = 0;
  bool waiting_ = false, close_ = false, body_unread_ = false;
};

}  // namespace slsd::web
