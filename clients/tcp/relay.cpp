// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/tcp/relay.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <iostream>
#include <utility>

#include <fmt/format.h>
#include <asio/buffer.hpp>
#include <asio/write.hpp>

#include "drivers/system/file_descriptor.hpp"
#include "rpc/message.hpp"

namespace slsd::tcp {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kStrangersOfOneMax = 4;  // connections of one address that have sent no token yet
constexpr int kPartingMax = 32;        // more would keep descriptors from others
constexpr std::size_t kThrowAwayBytes = 1 << 20;

// A peer that lost its power or its cable sends nothing, not even an end.
void find_dead_peers(int socket) {
  const auto set = [&](int level, int option, int value) { ::setsockopt(socket, level, option, &value, sizeof value); };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 10);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 5);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(IPPROTO_TCP, TCP_NODELAY, 1);
}

RpcError no_service(const std::error_code& error, const std::string& socket) {
  if (error == std::errc::permission_denied)
    return rpc_error(
        {ErrorCode::kPermissionDenied, "slsd-tcp may not use this socket: run it in the group slsd", socket});
  if (error == std::errc::resource_unavailable_try_again)
    return rpc_error(
        {ErrorCode::kBusy, "the service does not accept connections: check its log, or restart it", socket});
  if (error == std::errc::no_such_file_or_directory || error == std::errc::connection_refused)
    return rpc_error({ErrorCode::kNotFound, "no service answers there: start slsd (systemctl start slsd)", socket});
  return rpc_error({ErrorCode::kIo, error.message(), socket});
}

bool is_allowed(const std::vector<AddressRange>& ranges, const asio::ip::address& address) {
  return std::any_of(ranges.begin(), ranges.end(), [&](const auto& range) { return range.contains(address); });
}

}  // namespace

void RelayRoom::note_refusal(const std::string& address, const std::string& why) {
  const auto now = Clock::now();
  if (now - noted_ < 1s) {
    ++not_noted_;
    return;
  }
  noted_ = now;
  const int more = std::exchange(not_noted_, 0);
  std::cerr << "slsd-tcp: refused " << address << ": " << why
            << (more > 0 ? fmt::format(" ({} more refusals since the last)", more) : std::string()) << std::endl;
}

Relay::Relay(RelayRoom& room, asio::ip::tcp::socket peer)
    : room_(room), peer_(std::move(peer)), service_(room.events), deadline_(room.events) {}

Relay::~Relay() {
  enter(Phase::kNew);
}

// Counts relays by phase.
void Relay::enter(Phase phase) {
  switch (std::exchange(phase_, phase)) {
    case Phase::kNew:
      break;
    case Phase::kStranger:
      if (--room_.strangers[address_] == 0) room_.strangers.erase(address_);
      break;
    case Phase::kClient:
      --room_.clients;
      std::cerr << "slsd-tcp: " << address_ << " disconnected" << std::endl;
      break;
    case Phase::kParting:
      --room_.parting;
      break;
  }
  if (phase == Phase::kStranger) ++room_.strangers[address_];
  if (phase == Phase::kClient) ++room_.clients;
  if (phase == Phase::kParting) ++room_.parting;
}

void Relay::start() {
  std::error_code gone;
  const auto address = peer_.remote_endpoint(gone).address();
  if (gone) return;
  address_ = text_of(address);
  find_dead_peers(peer_.native_handle());
  if (!is_allowed(room_.options.allow, address)) {
    return refuse(nullptr,
                  rpc_error({ErrorCode::kPermissionDenied,
                             "this address may not connect: start slsd-tcp with --allow and this address", address_}));
  }
  const auto waiting = room_.strangers.find(address_);
  if (waiting != room_.strangers.end() && waiting->second >= kStrangersOfOneMax) {
    return refuse(nullptr,
                  rpc_error({ErrorCode::kBusy,
                             fmt::format("{} connections from this address have sent no token: close them, or wait",
                                         kStrangersOfOneMax),
                             address_}));
  }
  enter(Phase::kStranger);
  set_deadline(room_.options.token_timeout, &Relay::read_greeting);
  read_peer();
}

void Relay::set_deadline(std::chrono::milliseconds after, void (Relay::*then)()) {
  deadline_.expires_after(after);
  deadline_.async_wait([weak = weak_from_this(), then](const std::error_code& cancelled) {
    const auto self = weak.lock();
    if (cancelled || !self || self->deadline_.expiry() > Clock::now()) return;
    ((*self).*then)();
  });
}

// A wait that has just expired finds that its time was taken back.
void Relay::clear_deadline() {
  deadline_.expires_at(Clock::time_point::max());
}

// ---- What the client sends ----

void Relay::read_peer() {
  if (std::exchange(reading_, true)) return;
  peer_.async_read_some(asio::buffer(from_peer_),
                        [self = shared_from_this()](const std::error_code& error, std::size_t bytes) {
                          self->reading_ = false;
                          if (error == asio::error::eof) return self->on_peer_ended();
                          if (error) return self->close();
                          self->on_received(bytes);
                        });
}

void Relay::on_received(std::size_t bytes) {
  if (phase_ == Phase::kParting) {
    thrown_away_ += bytes;
    return thrown_away_ < kThrowAwayBytes ? read_peer() : close();
  }
  requests_.append({from_peer_.data(), bytes});
  phase_ == Phase::kStranger ? read_greeting() : pass_on();
}

// The client may only have shut down its writing side, and still gets its answers.
void Relay::on_peer_ended() {
  peer_ended_ = true;
  if (phase_ == Phase::kStranger && requests_.size() > 0) return judge_greeting(requests_.take_held());
  phase_ == Phase::kClient ? pass_rest_on() : close();
}

void Relay::pass_rest_on() {
  to_service_ = requests_.take_rest();
  asio::async_write(service_, asio::buffer(to_service_),
                    [self = shared_from_this()](const std::error_code&, std::size_t) {
                      std::error_code gone;
                      self->service_.shutdown(asio::socket_base::shutdown_send, gone);
                    });
}

void Relay::read_greeting() {
  if (phase_ != Phase::kStranger) return;
  const auto line = requests_.first_line();
  if (!line && deadline_.expiry() <= Clock::now())
    return refuse(nullptr, rpc_error({ErrorCode::kTimeout, "no token came in time; the connection ends", {}}));
  if (!line && requests_.size() <= kGreetingBytesMax) return read_peer();
  judge_greeting(line ? *line : std::string(kGreetingBytesMax + 1, ' '));
}

void Relay::judge_greeting(std::string_view line) {
  const auto greeting = tcp::read_greeting(line);
  if (!greeting) return refuse(greeting.error().id, greeting.error().error);
  admit(*greeting);
}

void Relay::admit(const Greeting& greeting) {
  switch (room_.tokens.check(address_, greeting.token, Clock::now())) {
    case TokenCheck::Verdict::kWait:
      return refuse(greeting.id,
                    rpc_error({ErrorCode::kBusy, "too many wrong tokens from this address: wait half a minute", {}}));
    case TokenCheck::Verdict::kWrong:
      return refuse(greeting.id,
                    rpc_error({ErrorCode::kPermissionDenied, "that is not the token of this scanner", {}}));
    case TokenCheck::Verdict::kRight:
      break;
  }
  if (room_.clients >= room_.options.clients_max) {
    return refuse(greeting.id,
                  rpc_error({ErrorCode::kBusy,
                             fmt::format("{} clients are connected: try again later, or raise --clients-max",
                                         room_.options.clients_max),
                             {}}));
  }
  connect(greeting);
}

void Relay::connect(const Greeting& greeting) {
  clear_deadline();
  if (const std::error_code error = connect_to_service()) {
    return refuse(greeting.id, no_service(error, room_.options.socket.string()));
  }
  enter(Phase::kClient);
  std::cerr << "slsd-tcp: " << address_ << " connected" << std::endl;
  if (greeting.wants_reply) to_peer_ = to_line(result_message(greeting.id, nlohmann::json::object()));
  set_deadline(room_.options.send_timeout, &Relay::close);
  asio::async_write(peer_, asio::buffer(to_peer_),
                    [self = shared_from_this()](const std::error_code& failed, std::size_t) {
                      if (failed) return self->close();
                      self->clear_deadline();
                      self->read_service();
                      self->pass_on();
                    });
}

// Never waits: the kernel answers at once whether the service's queue has a place. Asio would take a full queue for a
// connection under way.
std::error_code Relay::connect_to_service() {
  const asio::local::stream_protocol::endpoint endpoint(room_.options.socket.string());
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket || ::connect(socket.number(), endpoint.data(), static_cast<socklen_t>(endpoint.size())) != 0)
    return {errno, std::generic_category()};
  std::error_code error;
  service_.assign({}, socket.number(), error);
  if (!error) (void)socket.release();
  return error;
}

// Reads no more from the client until the service took what came.
void Relay::pass_on() {
  if (peer_ended_) return pass_rest_on();  // Asio reports an end once: another read would wait for ever
  to_service_ = requests_.take();
  if (to_service_.empty()) return read_peer();
  asio::async_write(service_, asio::buffer(to_service_),
                    [self = shared_from_this()](const std::error_code& error, std::size_t) {
                      if (!error) self->read_peer();  // else the service's last answer, and its end, are to be read
                    });
}

// ---- What the service answers ----

void Relay::read_service() {
  service_.async_read_some(asio::buffer(from_service_),
                           [self = shared_from_this()](const std::error_code& error, std::size_t bytes) {
                             error ? self->part() : self->send_answer(bytes);
                           });
}

void Relay::send_answer(std::size_t bytes) {
  set_deadline(room_.options.send_timeout, &Relay::close);
  asio::async_write(peer_, asio::buffer(from_service_.data(), bytes),
                    [self = shared_from_this()](const std::error_code& error, std::size_t) {
                      if (error) return self->close();
                      self->clear_deadline();
                      self->read_service();
                    });
}

// ---- The end ----

void Relay::refuse(const nlohmann::json& id, const RpcError& error) {
  room_.note_refusal(address_, error.message);
  to_peer_ = to_line(error_message(id, error));
  enter(Phase::kNew);
  // A new connection's buffer takes a line at once.
  asio::async_write(peer_, asio::buffer(to_peer_),
                    [self = shared_from_this()](const std::error_code& failed, std::size_t) {
                      failed ? self->close() : self->part();
                    });
}

// To close a socket with unread bytes would reset it, and the client could lose its last answer.
void Relay::part() {
  std::error_code gone;
  service_.close(gone);
  peer_.shutdown(asio::socket_base::shutdown_send, gone);
  if (gone || peer_ended_ || room_.parting >= kPartingMax) return close();
  enter(Phase::kParting);
  set_deadline(room_.options.parting_timeout, &Relay::close);
  read_peer();
}

void Relay::close() {
  std::error_code gone;
  deadline_.cancel();
  service_.close(gone);
  peer_.close(gone);
}

}  // namespace slsd::tcp
