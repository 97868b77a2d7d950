// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/session.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <spdlog/spdlog.h>
#include <asio/buffer.hpp>
#include <asio/post.hpp>

#include "daemon/rpc/message.hpp"

namespace slsd {
namespace {

bool blank(const std::string& line) {
  return line.find_first_not_of(" \t") == std::string::npos;
}

// Sends the start of a text together with a descriptor. -1 with errno, as sendmsg().
ssize_t send_descriptor(int socket, const std::string& text, int descriptor) {
  iovec part{const_cast<char*>(text.data()), text.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof(int));
  return ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

}  // namespace

Session::Session(Socket socket, const ServerOptions& options, const Handler& handler, Ended ended)
    : socket_(std::move(socket)),
      options_(options),
      handler_(handler),
      ended_(std::move(ended)),
      progress_(socket_.get_executor()),
      lines_(static_cast<std::size_t>(options.request_bytes_max)) {}

void Session::end() {
  if (std::exchange(over_, true)) return;
  std::error_code ignored;
  socket_.close(ignored);
  progress_.cancel();
  subscription_.reset();
  ended_(*this);
}

void Session::read() {
  socket_.async_read_some(
      asio::buffer(chunk_),
      [self = shared_from_this()](const std::error_code& error, std::size_t size) { self->on_read(error, size); });
}

void Session::on_read(const std::error_code& error, std::size_t size) {
  if (over_ || last_reply_) return;
  if (error) {
    hung_up_ = true;
    if (error != asio::error::eof) return end();
  } else {
    lines_.append({chunk_.data(), size});
  }
  next_request();
}

void Session::next_request() {
  while (!answering_ && !over_) {
    auto line = lines_.next_line();
    if (!line && lines_.overflown()) {
      last_reply_ = true;
      return refuse(nullptr, invalid_request("a request has at most " + std::to_string(options_.request_bytes_max) +
                                             " bytes; the connection ends"));
    }
    if (!line && hung_up_) {
      line = lines_.rest();
      last_reply_ = true;
      if (!line) return on_answered();
    }
    if (!line) return read();
    if (!blank(*line)) answer(*line);
  }
}

void Session::answer(const std::string& line) {
  answering_ = true;
  const auto request = parse_request(line);
  if (!request) return refuse(request.error().id, request.error().error);
  handler_(*request, *this,
           [weak = weak_from_this(), id = request->id, wanted = request->wants_reply](Outcome outcome) {
             if (const auto self = weak.lock()) self->reply(id, wanted, std::move(outcome));
           });
}

void Session::refuse(const nlohmann::json& id, const RpcError& error) {
  answering_ = true;
  Outgoing outgoing;
  outgoing.line = to_line(error_message(id, error));
  send(std::move(outgoing));
}

void Session::reply(const nlohmann::json& id, bool wanted, Outcome outcome) {
  if (over_) return;
  // By way of the event loop: a line of many notifications must not become a deep stack.
  if (!wanted) return asio::post(socket_.get_executor(), [self = shared_from_this()] { self->on_answered(); });
  if (!outcome) return refuse(id, outcome.error());
  for (Outgoing& event : outcome->first) send(std::move(event));
  Outgoing outgoing;
  outgoing.line = to_line(result_message(id, std::move(outcome->result)));
  outgoing.bytes = std::move(outcome->bytes);
  outgoing.descriptor = std::move(outcome->descriptor);
  send(std::move(outgoing));
}

void Session::on_answered() {
  answering_ = false;
  if (last_reply_ && outgoing_.empty()) return end();
  if (!last_reply_) next_request();
}

void Session::publish(const SharedPublication& publication, std::uint64_t lost) {
  if (!subscription_ || over_) return;
  subscription_->note_lost(lost);
  subscription_->offer(publication, Subscription::Clock::now());
  send_waiting_event();
}

void Session::send_waiting_event() {
  const auto is_event = [](const Outgoing& outgoing) { return outgoing.kind == Outgoing::Kind::kEvent; };
  if (over_ || !subscription_ || std::ranges::any_of(outgoing_, is_event)) return;
  if (auto event = subscription_->take(Subscription::Clock::now())) send(std::move(*event));
}

void Session::send(Outgoing outgoing) {
  if (over_) return;
  outgoing_.push_back(std::move(outgoing));
  if (outgoing_.size() == 1) write();
}

void Session::write() {
  watch_progress();
  const Outgoing& front = outgoing_.front();
  if (front.descriptor && sent_ == 0) return write_with_descriptor();
  const std::size_t line_sent = std::min(sent_, front.line.size());
  const std::array parts{asio::buffer(front.line) + line_sent,
                         (front.bytes ? asio::buffer(*front.bytes) : asio::const_buffer()) + (sent_ - line_sent)};
  socket_.async_write_some(parts, [self = shared_from_this()](const std::error_code& error, std::size_t size) {
    self->on_written(error, size);
  });
}

void Session::write_with_descriptor() {
  socket_.async_wait(Socket::wait_write, [self = shared_from_this()](const std::error_code& error) {
    if (error || self->over_) return self->on_written(error, 0);
    const Outgoing& front = self->outgoing_.front();
    const ssize_t sent = send_descriptor(self->socket_.native_handle(), front.line, front.descriptor.number());
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return self->end();
    self->on_written(error, sent < 0 ? 0 : static_cast<std::size_t>(sent));
  });
}

void Session::on_written(const std::error_code& error, std::size_t size) {
  if (over_) return;
  if (error) return end();
  sent_ += size;
  if (sent_ < outgoing_.front().size()) return write();
  const bool replied = outgoing_.front().kind == Outgoing::Kind::kReply;
  outgoing_.pop_front();
  sent_ = 0;
  progress_.cancel();
  if (!outgoing_.empty()) write();
  send_waiting_event();
  if (replied || (last_reply_ && outgoing_.empty())) on_answered();
}

void Session::watch_progress() {
  progress_.expires_after(options_.send_timeout());
  progress_.async_wait([weak = weak_from_this()](const std::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || self->over_) return;
    spdlog::info("a client read nothing for {} ms: dropped", self->options_.send_timeout_ms);
    self->end();
  });
}

}  // namespace slsd
