// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/connection.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <sstream>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/write.hpp>

#include "core/printable.hpp"
#include "rpc/message.hpp"

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using boost::system::error_code;
namespace asio = boost::asio;
namespace http = boost::beast::http;

constexpr auto kIdle = 5s;     // between two requests
constexpr auto kRequest = 5s;  // from a request's first byte to its last
constexpr int kCrowd = 128;    // with more silent or slow connections, each has less time:
constexpr auto kIdleInCrowd = 200ms;
constexpr auto kRequestInCrowd = 1s;
constexpr auto kWrite = 10s;  // for each of these:
constexpr std::size_t kWriteBytes = 1 << 20;
constexpr int kRequestsMax = 1000;
constexpr auto kThrowAway = 2s;  // closing a socket with unread bytes at once would reset it and lose the answer
constexpr std::size_t kThrowAwayBytes = 1 << 20;

std::string text_of(const asio::ip::address& address) {
  const bool mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return mapped ? asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6()).to_string() : address.to_string();
}

}  // namespace

Answer answer_of(const Refusal& refusal) {
  const nlohmann::json error{{"error", {{"name", refusal.name}, {"message", printable(refusal.message, 1500)}}}};
  return {refusal.status, "application/json", client::Bytes(to_line(error)), {}, {}};
}

HttpConnection::HttpConnection(Shared& shared, asio::ip::tcp::socket socket)
    : shared_(shared), stream_(std::move(socket)) {
  ++shared_.open;
}

HttpConnection::~HttpConnection() {
  set_waiting(false);
  --shared_.open;
  shared_.on_closed();
}

void HttpConnection::set_waiting(bool waiting) {
  if (waiting_ == waiting) return;
  waiting_ = waiting;
  shared_.waiting += waiting ? 1 : -1;
}

// Any error ends the connection: the callback holds the last reference to it.
template <class Then>
void HttpConnection::read_more(Then then) {
  stream_.async_read_some(asio::buffer(piece_),
                          [self = shared_from_this(), then](const error_code& error, std::size_t bytes) {
                            if (error) return;
                            self->received_.append(self->piece_.data(), bytes);
                            then(*self);
                          });
}

void HttpConnection::wait_for_request() {
  set_waiting(true);
  const auto begin = [](HttpConnection& self) {
    self.stream_.expires_after(self.shared_.waiting > kCrowd ? std::chrono::milliseconds(kRequestInCrowd) : kRequest);
    self.read_head();
  };
  if (!received_.empty()) return begin(*this);
  stream_.expires_after(shared_.waiting > kCrowd ? kIdleInCrowd : std::chrono::milliseconds(kIdle));
  read_more(begin);
}

void HttpConnection::read_head() {
  const HeadEnd end = find_head_end(received_);
  if (end.refusal) return refuse(*end.refusal, /*head_is_whole=*/false);
  if (end.bytes == 0) return read_more([](HttpConnection& self) { self.read_head(); });
  auto request = web::read_head(std::string_view(received_).substr(0, end.bytes));
  if (!request) return refuse(request.error(), /*head_is_whole=*/false);
  request_ = std::move(*request);
  received_.erase(0, end.bytes);
  admit();
}

// A body is read only if the head is admitted; an unread body ends the connection.
void HttpConnection::admit() {
  error_code gone;
  request_.address = text_of(stream_.socket().remote_endpoint(gone).address());
  if (!gone) request_.local_address = text_of(stream_.socket().local_endpoint(gone).address());
  if (gone) return;
  if (request_.body_bytes > shared_.handlers.body_bytes_max)
    return refuse({413, "invalid_request", "the request's body is too long"}, /*head_is_whole=*/true);
  if (auto refused = shared_.handlers.refuse(request_)) return send(std::move(*refused), request_.body_bytes > 0);
  if (!request_.expects_continue || request_.body_bytes == 0) return read_body();
  static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
  asio::async_write(stream_, asio::buffer(kContinue),
                    [self = shared_from_this()](const error_code& error, std::size_t) {
                      if (!error) self->read_body();
                    });
}

void HttpConnection::read_body() {
  if (received_.size() < request_.body_bytes) return read_more([](HttpConnection& self) { self.read_body(); });
  request_.body = received_.substr(0, request_.body_bytes);
  received_.erase(0, request_.body_bytes);
  set_waiting(false);
  have_answered();
}

// Nothing is read meanwhile: further data from the peer waits in its socket.
void HttpConnection::have_answered() {
  stream_.expires_never();
  asio::post(shared_.workers, [self = shared_from_this()]() mutable {
    Answer answer;
    try {
      answer = self->shared_.handlers.answer(self->request_);
    } catch (const std::exception& error) {
      answer = answer_of({500, "internal", error.what()});
    }
    auto& io = self->shared_.io;
    asio::post(io, [self = std::move(self), answer = std::move(answer)]() mutable {
      self->send(std::move(answer), /*close=*/false);
    });
  });
}

void HttpConnection::refuse(const Refusal& refusal, bool head_is_whole) {
  if (!head_is_whole) {
    request_ = {};
    if (received_.starts_with("HEAD ")) request_.method = "HEAD";  // its answer has no body
  }
  send(answer_of(refusal), /*close=*/true);
}

std::string HttpConnection::head_of(const Answer& answer) const {
  http::response<http::empty_body> head(static_cast<http::status>(answer.status), 11);
  head.keep_alive(!close_);
  for (const auto* headers : {&std::as_const(shared_.handlers.headers), &answer.headers}) {
    for (const auto& [name, value] : *headers) head.set(name, value);
  }
  if (!answer.type.empty()) head.set(http::field::content_type, answer.type);
  if (answer.status != 204) head.content_length(answer.body.size());
  std::ostringstream text;
  text << head.base();
  return text.str();
}

void HttpConnection::send(Answer answer, bool close) {
  set_waiting(false);
  answer_ = std::move(answer);
  close_ = close || !request_.keep_alive || ++served_ >= kRequestsMax;
  head_ = head_of(answer_);
  stream_.expires_after(kWrite);
  asio::async_write(stream_, asio::buffer(head_), [self = shared_from_this()](const error_code& error, std::size_t) {
    if (error) return;
    self->request_.method == "HEAD" ? self->finish() : self->send_body(0);
  });
}

void HttpConnection::send_body(std::size_t from) {
  const std::string_view piece = answer_.body.view().substr(from, kWriteBytes);
  if (piece.empty()) return finish();
  stream_.expires_after(kWrite);
  asio::async_write(stream_, asio::const_buffer(piece.data(), piece.size()),
                    [self = shared_from_this(), from, piece](const error_code& error, std::size_t) {
                      if (self->answer_.on_sent) self->answer_.on_sent(piece);
                      if (!error) self->send_body(from + piece.size());
                    });
}

void HttpConnection::finish() {
  answer_ = {};
  if (!close_) return wait_for_request();
  error_code gone;
  stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, gone);
  received_.clear();
  stream_.expires_after(kThrowAway);
  throw_away();
}

void HttpConnection::throw_away() {
  stream_.async_read_some(asio::buffer(piece_),
                          [self = shared_from_this()](const error_code& error, std::size_t bytes) {
                            self->thrown_away_ += bytes;
                            if (!error && self->thrown_away_ < kThrowAwayBytes) self->throw_away();
                          });
}

}  // namespace slsd::web
