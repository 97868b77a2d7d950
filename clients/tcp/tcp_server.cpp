// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/tcp/tcp_server.hpp"

#include <chrono>
#include <csignal>
#include <memory>
#include <utility>

#include <asio/signal_set.hpp>

#include "clients/access/cannot_listen.hpp"

namespace slsd::tcp {
namespace {

using asio::ip::tcp;

constexpr int kBacklog = 64;
constexpr std::chrono::milliseconds kPause{100};

}  // namespace

Result<> TcpServer::open() {
  const TcpOptions& options = room_.options;
  std::error_code error;
  const auto address = asio::ip::make_address(options.listen, error);
  if (error) return fail(ErrorCode::kInvalidArgument, "not an IP address of this machine", options.listen);
  const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(options.port));
  acceptor_.open(endpoint.protocol(), error);
  // Takes over a port that only old connections use; not one with a listener (no SO_REUSEPORT).
  if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(kBacklog, error);
  if (error) return tl::unexpected(cannot_listen(options.listen, options.port, error));
  accept();
  return {};
}

int TcpServer::port() const {
  std::error_code gone;
  return acceptor_.local_endpoint(gone).port();
}

void TcpServer::run() {
  asio::signal_set signals(events_, SIGINT, SIGTERM);
  signals.async_wait([this](const std::error_code& error, int) {
    if (!error) events_.stop();
  });
  events_.run();
}

void TcpServer::accept() {
  acceptor_.async_accept([this](const std::error_code& error, tcp::socket socket) {
    if (error) return pause();
    std::make_shared<Relay>(room_, std::move(socket))->start();
    accept();
  });
}

// For example, the process has no free descriptor: an immediate retry would fail again.
void TcpServer::pause() {
  pause_.expires_after(kPause);
  pause_.async_wait([this](const std::error_code& error) {
    if (!error) accept();
  });
}

}  // namespace slsd::tcp
