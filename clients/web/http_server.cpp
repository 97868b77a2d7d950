// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/http_server.hpp"

#include <chrono>
#include <csignal>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include "clients/access/cannot_listen.hpp"
#include "clients/web/connection.hpp"

namespace slsd::web {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kWorkers = 48;  // each watcher occupies one while it waits for a cloud
constexpr int kConnectionsMax = 500;  // by default a process may have 1024 files
constexpr int kBacklog = 64;
constexpr std::chrono::milliseconds kPause{100};

class Server final : public HttpServer {
 public:
  explicit Server(Handlers handlers) : shared_{std::move(handlers), {}, {}, {}, {}, kWorkers} {}

  [[nodiscard]] error_code listen(const std::string& address, int port) {
    error_code error;
    const auto found =
        tcp::resolver(shared_.io).resolve(address, std::to_string(port), tcp::resolver::numeric_service, error);
    if (error) return error;
    const tcp::endpoint endpoint = found.begin()->endpoint();
    acceptor_.open(endpoint.protocol(), error);
    // Takes over a port that only old connections use; not one with a listener (no SO_REUSEPORT).
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(kBacklog, error);
    return error;
  }

  int port() const override {
    error_code gone;
    return acceptor_.local_endpoint(gone).port();
  }

  void run(const std::function<void()>& at_end) override {
    shared_.on_closed = [this] { accept(); };
    boost::asio::signal_set signals(shared_.io, SIGINT, SIGTERM);
    int ended_by = SIGTERM;
    signals.async_wait([&](const error_code&, int number) {
      ended_by = number;
      shared_.io.stop();
    });
    accept();
    shared_.io.run();
    at_end();
    // Workers may wait long for the service, so the signal ends them.
    std::signal(ended_by, SIG_DFL);
    std::raise(ended_by);
  }

 private:
  void accept() {
    if (accepting_ || shared_.open >= kConnectionsMax) return;
    accepting_ = true;
    acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
      if (error) return pause();
      accepting_ = false;
      error_code gone;
      socket.set_option(tcp::no_delay(true), gone);
      std::make_shared<HttpConnection>(shared_, std::move(socket))->wait_for_request();
      accept();
    });
  }
  // For example, the process has no free descriptor: an immediate retry would fail again.
  void pause() {
    pause_.expires_after(kPause);
    pause_.async_wait([this](const error_code&) {
      accepting_ = false;
      accept();
    });
  }

  Shared shared_;
  tcp::acceptor acceptor_{shared_.io};
  boost::asio::steady_timer pause_{shared_.io};
  bool accepting_ = false;
};

}  // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::open(const std::string& address, int port, Handlers handlers) {
  auto server = std::make_unique<Server>(std::move(handlers));
  if (const error_code error = server->listen(address, port))
    return tl::unexpected(cannot_listen(address, port, error));
  return server;
}

}  // namespace slsd::web
