// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/session.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <spdlog/spdlog.h>
#include <asio/buffer.hpp>

#include "daemon/scan/message_ids.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kTurn = 250us;            // so a round of 64 clients takes 16 ms
constexpr auto kByteCost = 10ns;         // to parse a long line
constexpr std::size_t kSlice = 1 << 20;  // must be read within the send timeout
constexpr auto kGlance = 200ms;          // interval between checks whether a client that sends urgent bytes is gone
constexpr std::size_t kMiB = 1 << 20;

bool blank(std::string_view line) {
  return line.find_first_not_of(" \t") == std::string_view::npos;
}

bool is_event(const Outgoing& outgoing) {
  return outgoing.kind == Outgoing::Kind::kEvent;
}

// Like sendmsg(): sends the rest of a message, with the descriptor at its first byte.
ssize_t send_part(int socket, const Outgoing& outgoing, std::size_t sent) {
  const std::size_t line_sent = std::min(sent, outgoing.line.size());
  std::array<iovec, 2> parts{};
  parts[0] = {const_cast<char*>(outgoing.line.data()) + line_sent, outgoing.line.size() - line_sent};
  if (outgoing.bytes) {
    const std::size_t bytes_sent = sent - line_sent;
    parts[1] = {const_cast<char*>(outgoing.bytes->data()) + bytes_sent, outgoing.bytes->size() - bytes_sent};
  }
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  if (outgoing.descriptor && sent == 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    const int descriptor = outgoing.descriptor.number();
    std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
  }
  return ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::string megabytes(std::size_t bytes) {
  return std::to_string((bytes + kMiB - 1) / kMiB) + " MB";
}

}  // namespace

Session::Session(Socket socket, std::shared_ptr<SessionRoom> room)
    : socket_(std::move(socket)),
      shared_room_(std::move(room)),
      room_(*shared_room_),
      peer_(peer_of(socket_.native_handle())),
      role_(room_.access.role_of(peer_)),
      // An administrator may use several programs at once; each is a client.
      memory_(room_.memory, role_ == Role::kAdminister ? std::nullopt : std::optional(peer_.user)),
      progress_(socket_.get_executor()),
      glance_(socket_.get_executor()),
      lines_(static_cast<std::size_t>(room_.options.request_bytes_max)) {}

void Session::start() {
  std::error_code error;
  socket_.native_non_blocking(true, error);
  if (error) return end();
  await_hang_up();
  await_input();
}

void Session::end() {
  if (std::exchange(over_, true)) return;
  gone_.request_stop();
  std::error_code ignored;
  socket_.close(ignored);
  progress_.cancel();
  glance_.cancel();
  room_.ended(*this, subscription_.has_value());
}

void Session::wind_down() {
  closing_ = true;
  input_ = Input::kShut;
  end_where_done();
}

void Session::end_where_done() {
  const bool listens = subscription_ && !closing_ && !gone_.stop_requested();
  if (input_ == Input::kShut && !answering_ && outgoing_.empty() && !listens) end();
}

// ---- What the client sends ----

void Session::await_input() {
  socket_.async_wait(Socket::wait_read, [self = shared_from_this()](const std::error_code& error) {
    if (!error && !self->over_) self->ask_turn();
  });
}

void Session::ask_turn() {
  if (taker_.asked) return;
  const auto cost = kByteCost * lines_.size();  // a long line may be about to be complete
  room_.turns.ask(taker_, cost, [self = shared_from_this()] { self->take_turn(); });
}

void Session::take_turn() {
  const auto end = Clock::now() + kTurn;
  in_turn_ = true;
  bool more = true;
  while (more && !answering_ && !over_ && input_ != Input::kShut && Clock::now() < end) {
    const auto line = next_line();
    if (!line) {
      more = receive();
    } else if (!blank(*line)) {
      answer(*line);
    }
  }
  in_turn_ = false;
  if (more && !answering_ && !over_ && input_ != Input::kShut) ask_turn();
}

std::optional<std::string_view> Session::next_line() {
  auto line = lines_.next_line();
  if (!line && !lines_.overflown() && input_ == Input::kEnded) line = lines_.rest();
  return line;
}

// Tells whether a line may be ready.
bool Session::receive() {
  if (lines_.overflown()) {
    closing_ = true;
    input_ = Input::kShut;
    refuse(nullptr, invalid_request("a request has at most " + std::to_string(room_.options.request_bytes_max) +
                                    " bytes; the connection ends"));
    return false;
  }
  if (input_ == Input::kEnded) {
    input_ = Input::kShut;
    end_where_done();
    return false;
  }
  (void)memory_.resize(MemoryAccount::Part::kRequest, lines_.capacity());  // it may have shrunk
  const ssize_t size = ::recv(socket_.native_handle(), room_.chunk.data(), room_.chunk.size(), MSG_DONTWAIT);
  if (size < 0 && errno == EINTR) return true;
  if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return await_input(), false;
  if (size < 0) return end(), false;
  if (size == 0) {
    input_ = Input::kEnded;
    return true;
  }
  room_.traffic.bytes_received += static_cast<std::uint64_t>(size);
  lines_.append({room_.chunk.data(), static_cast<std::size_t>(size)});
  if (memory_.resize(MemoryAccount::Part::kRequest, lines_.capacity())) return true;
  lines_.clear();
  memory_.release(MemoryAccount::Part::kRequest);
  closing_ = true;
  input_ = Input::kShut;
  refuse(
      nullptr,
      rpc_error({ErrorCode::kBusy,
                 "other clients hold the memory that this long request needs: send it again later; the connection ends",
                 {}}));
  return false;
}

// ---- Whether it is there ----

// Only EPOLLHUP means that the client is gone. Urgent bytes from it wake this wait too, and would do so for ever.
void Session::await_hang_up() {
  socket_.async_wait(Socket::wait_error, [self = shared_from_this()](const std::error_code& error) {
    if (error || self->over_) return;
    pollfd look{self->socket_.native_handle(), 0, 0};
    if (::poll(&look, 1, 0) == 1 && (look.revents & (POLLHUP | POLLERR)) != 0) return self->on_hang_up();
    self->glance_.expires_after(kGlance);
    self->glance_.async_wait([self](const std::error_code& cancelled) {
      if (!cancelled && !self->over_) self->await_hang_up();
    });
  });
}

void Session::on_hang_up() {
  gone_.request_stop();
  if (!outgoing_.empty() || input_ == Input::kShut) return end();
  if (!answering_ || !wanted_) return;  // unread input remains: await_input() sees the end too
  ++number_;                            // the request's outcome goes nowhere
  on_answered();
}

// ---- Requests and their replies ----

void Session::answer(std::string_view line) {
  answering_ = true;
  ++number_;
  auto request = parse_request(line);
  wanted_ = !request || request->wants_reply;
  if (wanted_ && gone_.stop_requested()) return on_answered();
  if (!request) return refuse(request.error().id, request.error().error);
  id_ = request->id;
  room_.handler(*request, *this, [weak = weak_from_this(), number = number_](Outcome outcome) {
    if (const auto self = weak.lock()) self->reply(number, std::move(outcome));
  });
}

std::optional<RpcError> Session::reserve(std::size_t bytes) {
  const auto grant = [&] { return memory_.resize(MemoryAccount::Part::kReply, bytes); };
  if (grant()) return std::nullopt;
  room_.lent.sweep();
  if (grant()) return std::nullopt;
  const std::string limit = "[server] memory_max_mb is " + std::to_string(room_.options.memory_max_mb);
  if (bytes > room_.memory.limit_of_one()) {
    return rpc_error({ErrorCode::kBusy,
                      "this takes up to " + megabytes(bytes) +
                          ", but one client gets at most half of all memory: " + limit + "; raise it, or ask for less",
                      {}});
  }
  return rpc_error({ErrorCode::kBusy,
                    "this takes up to " + megabytes(bytes) + ", more than other clients leave free: " + limit +
                        ", and " + megabytes(room_.memory.held()) +
                        " wait for clients to read them; try again later, or ask for less",
                    {}});
}

void Session::refuse(const nlohmann::json& id, const RpcError& error) {
  answering_ = wanted_ = true;
  Outgoing outgoing;
  outgoing.line = to_line(error_message(id, error));
  send(std::move(outgoing));
}

void Session::reply(std::uint64_t number, Outcome outcome) {
  if (over_ || !answering_ || number != number_) return;
  if (!wanted_) return on_answered();
  if (!outcome) return refuse(id_, outcome.error());
  Outgoing outgoing;
  outgoing.line = to_line(result_message(id_, std::move(outcome->result)));
  outgoing.bytes = std::move(outcome->bytes);
  std::size_t size = outgoing.size();
  for (const Outgoing& event : outcome->first) size += event.size();
  if (const auto refused = reserve(size)) return refuse(id_, *refused);
  if (outcome->memory) {
    if (auto lent = room_.lent.add(std::move(outcome->memory->kept), outcome->memory->bytes); !lent) {
      return refuse(id_, rpc_error(lent.error()));
    }
    outgoing.descriptor = std::move(outcome->memory->given);
  }
  for (Outgoing& event : outcome->first) outgoing_.push_back(std::move(event));
  send(std::move(outgoing));
}

void Session::on_answered() {
  answering_ = false;
  memory_.release(MemoryAccount::Part::kReply);
  if (over_ || in_turn_) return;  // the turn continues by itself
  if (input_ == Input::kShut) return end_where_done();
  ask_turn();
}

// ---- What goes out ----

void Session::publish(const SharedPublication& publication, std::uint64_t lost) {
  if (!subscription_ || closing_ || over_) return;
  subscription_->note_lost(lost);
  subscription_->offer(publication, Subscription::Clock::now());
  weigh_waiting();
  send_waiting_event();
  if (subscription_) room_.traffic.clouds_lost += subscription_->take_uncounted();
}

// Clouds that do not fit are lost, oldest first; the next event reports them.
void Session::weigh_waiting() {
  while (!memory_.resize(MemoryAccount::Part::kWaiting, subscription_->waiting_bytes())) subscription_->lose_oldest();
}

void Session::send_waiting_event() {
  constexpr std::size_t kMemfdsOfOne = 2;
  if (over_ || closing_ || !subscription_ || std::ranges::any_of(outgoing_, is_event)) return;
  // One descriptor is being read and one is to come; more would only wait in the socket.
  if (subscription_->as_memfd() && room_.lent.count_of(this) >= kMemfdsOfOne) return;
  auto event = subscription_->take(Subscription::Clock::now());
  weigh_waiting();
  if (!event) return;
  const bool granted = !event->kept || room_.lent.add(std::move(event->kept), event->lent_bytes, this);
  if (granted && memory_.resize(MemoryAccount::Part::kEvent, event->size())) return send(std::move(*event));
  subscription_->note_lost(1);  // the next event reports it
}

void Session::send(Outgoing outgoing) {
  if (over_) return;
  outgoing_.push_back(std::move(outgoing));
  if (!writing_) write();
}

// Sends what the socket accepts now, and continues when it accepts more. A message that fits at once costs no round of
// the event loop.
void Session::write() {
  writing_ = true;
  while (!over_ && !outgoing_.empty()) {
    const Outgoing& front = outgoing_.front();
    const ssize_t sent = send_part(socket_.native_handle(), front, sent_);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno == ETOOMANYREFS && front.descriptor) {
      withhold_descriptor();
      continue;
    }
    if (sent < 0 && errno != EAGAIN) return end();
    if (sent > 0) {
      sent_ += static_cast<std::size_t>(sent);
      room_.traffic.bytes_sent += static_cast<std::uint64_t>(sent);
      sent_at_ = Clock::now();
    }
    if (sent_ == front.size()) {
      finish_message();
      continue;
    }
    if (!timing_ || sent_ >= timed_ + kSlice) watch_progress();
    return socket_.async_wait(Socket::wait_write, [self = shared_from_this()](const std::error_code& error) {
      if (!self->over_ && error) self->end();
      if (!self->over_) self->write();
    });
  }
  writing_ = false;
  end_where_done();
}

// Sends the error in place of the message.
void Session::withhold_descriptor() {
  Outgoing& front = outgoing_.front();
  const RpcError error = rpc_error(
      {ErrorCode::kNoSpace, "too many file descriptors wait for clients to receive them: try again later", {}});
  front.line =
      to_line(is_event(front) ? event_message("scan_failed", {{"error", error.to_json()}}) : error_message(id_, error));
  front.descriptor = FileDescriptor();
  if (is_event(front) && subscription_) subscription_->note_lost(1);  // the next event reports it
}

void Session::finish_message() {
  const bool replied = !is_event(outgoing_.front());
  outgoing_.pop_front();
  sent_ = 0;
  if (std::exchange(timing_, false)) progress_.cancel();
  if (std::ranges::none_of(outgoing_, is_event)) memory_.release(MemoryAccount::Part::kEvent);
  if (replied) on_answered();
  send_waiting_event();
}

// A message may take the full time for each megabyte, and for the remainder. A limit in bytes alone would allow one
// byte a second.
void Session::watch_progress() {
  timed_ = sent_;
  timing_ = true;
  progress_.expires_after(room_.options.send_timeout());
  progress_.async_wait([weak = weak_from_this()](const std::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || self->over_ || !self->timing_) return;
    if (self->progress_.expiry() <= Clock::now()) self->drop();  // else the timer was set again meanwhile
  });
}

bool Session::is_sending_since(Clock::time_point time) const {
  return !over_ && !outgoing_.empty() && sent_at_ >= time;
}

// In the middle of a message no error can be sent: the client would take it for the message's own bytes. The cut
// message shows the failure, as do the log and the status.
void Session::drop() {
  ++room_.traffic.dropped;
  const MessageId id(MessageId::kClientDropped);
  spdlog::info("dropped a client (process {}, user {}) that read only {} of {} bytes in {} ms", peer_.process,
               peer_.user, sent_ - timed_, std::min(outgoing_.front().size() - timed_, kSlice),
               room_.options.send_timeout_ms);
  if (sent_ == 0) {
    const std::string line =
        to_line(error_message(nullptr, rpc_error({ErrorCode::kTimeout, "dropped: this client reads too slowly", {}})));
    ::send(socket_.native_handle(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  end();
}

}  // namespace slsd
