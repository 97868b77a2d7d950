// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/server.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>
#include <asio/post.hpp>

#include "rpc/message.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

constexpr auto kRetryAccept = 200ms;
constexpr std::size_t kWaitingMax = 4;  // lanes that finish together deliver more than one

}  // namespace

Server::Server(asio::io_context& events, const ServerOptions& options, Handler handler, DemandChanged demand_changed)
    : events_(events),
      room_(std::make_shared<SessionRoom>(events, options)),
      demand_changed_(std::move(demand_changed)),
      acceptor_(events),
      retry_(events) {
  room_->handler = std::move(handler);
  room_->ended = [this](Session& ended, bool subscribed) {
    sessions_.erase(ended.shared_from_this());
    if (subscribed) update_demand();
  };
}

Server::~Server() {
  end_all();
  room_->turns.clear();
}

Result<> Server::open() {
  auto socket = ListeningSocket::open(room_->options.socket, room_->options.socket_mode);
  if (!socket) return tl::unexpected(socket.error());
  socket_.emplace(std::move(*socket));
  std::error_code error;
  acceptor_.assign(asio::local::stream_protocol(), socket_->release(), error);
  if (error) return fail(ErrorCode::kIo, "cannot listen: " + error.message(), room_->options.socket.string());
  accept();
  return {};
}

void Server::wind_down() {
  std::error_code ignored;
  acceptor_.close(ignored);
  retry_.cancel();
  socket_.reset();
  const std::vector<std::shared_ptr<Session>> all(sessions_.begin(), sessions_.end());
  for (const auto& session : all) session->wind_down();
}

bool Server::is_sending_since(std::chrono::steady_clock::time_point time) const {
  return std::ranges::any_of(sessions_, [&](const auto& session) { return session->is_sending_since(time); });
}

void Server::end_all() {
  const std::vector<std::shared_ptr<Session>> all(sessions_.begin(), sessions_.end());
  for (const auto& session : all) session->end();
}

std::size_t Server::subscribers() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(sessions_, [](const auto& session) { return session->subscription().has_value(); }));
}

void Server::update_demand() {
  std::optional<FreeRun> demand;
  for (const auto& session : sessions_) {
    if (!session->subscription()) continue;
    if (!demand) demand.emplace();
    const double rate_hz = session->subscription()->rate_hz().value_or(std::numeric_limits<double>::infinity());
    demand->rate_hz = std::max(demand->rate_hz, rate_hz);
    const Subscription& wanted = *session->subscription();
    demand->formats = demand->formats | (wanted.as_memfd() ? CloudFormats::only_memory(wanted.form())
                                                           : CloudFormats::only(wanted.form()));
  }
  demand_changed_(demand);
}

void Server::accept() {
  acceptor_.async_accept(
      [this](const std::error_code& error, Session::Socket socket) { on_accepted(error, std::move(socket)); });
}

void Server::on_accepted(const std::error_code& error, Session::Socket socket) {
  if (!acceptor_.is_open() || error == asio::error::operation_aborted) return;
  if (error) return retry_later(error);
  retrying_ = false;
  const Peer peer = peer_of(socket.native_handle());
  if (const auto refused = refuses(peer)) {
    ++room_->traffic.refused;
    turn_away(std::move(socket), *refused);
  } else {
    const auto session = std::make_shared<Session>(std::move(socket), room_);
    ++room_->traffic.accepted;
    sessions_.insert(session);
    session->start();
  }
  accept();
}

// Tells why a client is refused. A user who is not an administrator gets at most as many places as are left for all
// others, so at most half.
std::optional<Error> Server::refuses(const Peer& peer) const {
  const auto places = static_cast<std::size_t>(room_->options.clients_max);
  if (sessions_.size() >= places)
    return Error{ErrorCode::kBusy, std::to_string(places) + " clients are connected: try again later", {}};
  const Role role = room_->access.role_of(peer);
  if (role == Role::kNone) {
    return Error{
        ErrorCode::kPermissionDenied,
        "user " + std::to_string(peer.user) + " may not use this scanner: " + room_->access.way_to(Role::kObserve),
        {}};
  }
  const auto own = static_cast<std::size_t>(
      std::ranges::count_if(sessions_, [&](const auto& session) { return session->peer().user == peer.user; }));
  if (role == Role::kAdminister || own < places - sessions_.size()) return std::nullopt;
  return Error{ErrorCode::kBusy,
               "user " + std::to_string(peer.user) + " already has " + std::to_string(own) + " of " +
                   std::to_string(places) + " connections, the most for one user: close some of them",
               {}};
}

void Server::turn_away(Session::Socket socket, const Error& error) {
  const std::string line = to_line(error_message(nullptr, rpc_error(error)));
  ::send(socket.native_handle(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

// Without descriptors or memory the kernel keeps the client waiting, and accept() would fail again at once.
void Server::retry_later(const std::error_code& error) {
  if (!std::exchange(retrying_, true)) spdlog::warn("cannot accept another client: {}", error.message());
  retry_.expires_after(kRetryAccept);
  retry_.async_wait([this](const std::error_code& cancelled) {
    if (!cancelled && acceptor_.is_open()) accept();
  });
}

void Server::publish(FreeScan scan) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kWaitingMax) {
    if (*waiting_.front()) ++lost_;
    waiting_.pop_front();
  }
  waiting_.push_back(std::move(scan));
  if (waiting_.size() == 1) asio::post(events_, [this] { deliver(); });
}

void Server::deliver() {
  std::deque<FreeScan> scans;
  std::uint64_t lost = 0;
  {
    const std::lock_guard lock(mutex_);
    scans.swap(waiting_);
    lost = std::exchange(lost_, 0);
  }
  for (FreeScan& scan : scans) {
    const auto publication = std::make_shared<Publication>(std::move(scan));
    const std::vector<std::shared_ptr<Session>> all(sessions_.begin(), sessions_.end());
    for (const auto& session : all) session->publish(publication, lost);
    lost = 0;
    if (delivered_ && publication->scan()) delivered_(*publication->scan());
  }
}

}  // namespace slsd
