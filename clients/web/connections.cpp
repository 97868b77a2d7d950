// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/connections.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kIdle = 5s;     // between two requests
constexpr auto kRequest = 5s;  // from a request's first byte to its last
constexpr int kCrowd = 24;     // so many that send nothing, or slowly, and each has less:
constexpr auto kIdleInCrowd = 200ms;
constexpr auto kRequestInCrowd = 1s;
constexpr auto kWrite = 10s;  // for each of these:
constexpr std::size_t kWriteBytes = 1 << 20;
constexpr int kRequestsMax = 1000;

/// Whether the socket is ready for the event before the deadline.
bool wait(socket_t socket, short event, Clock::time_point deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd look{socket, event, 0};
    const int ready = left <= 0 ? 0 : ::poll(&look, 1, static_cast<int>(left));
    if (ready < 0 && errno == EINTR) continue;
    return ready > 0;
  }
}

/// A socket with one deadline for all of a request.
class TimedStream final : public httplib::Stream {
 public:
  /// @param waiting  how many connections have no whole request yet; outlives this
  TimedStream(socket_t socket, std::atomic<int>& waiting) : socket_(socket), waiting_(waiting) {}
  ~TimedStream() override { finish_reading(); }
  TimedStream(const TimedStream&) = delete;
  TimedStream& operator=(const TimedStream&) = delete;

  /// Whether a request begins.
  [[nodiscard]] bool begin() {
    counted_ = true;
    ++waiting_;
    write_due_ = {};
    const auto idle = waiting_ > kCrowd ? Clock::duration(kIdleInCrowd) : Clock::duration(kIdle);
    if (begin_ == end_ && !wait(socket_, POLLIN, Clock::now() + idle)) return false;
    deadline_ = Clock::now() + (waiting_ > kCrowd ? Clock::duration(kRequestInCrowd) : Clock::duration(kRequest));
    return true;
  }
  /// It is whole, or over.
  void finish_reading() {
    if (std::exchange(counted_, false)) --waiting_;
  }

  bool is_readable() const override { return begin_ < end_ || wait(socket_, POLLIN, deadline_); }
  bool is_writable() const override { return wait(socket_, POLLOUT, Clock::now() + kWrite); }

  ssize_t read(char* to, size_t size) override {
    if (begin_ == end_) {
      if (!wait(socket_, POLLIN, deadline_)) return -1;
      const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
      if (count <= 0) return count;
      begin_ = 0;
      end_ = static_cast<std::size_t>(count);
    }
    const std::size_t count = std::min(size, end_ - begin_);
    std::copy_n(buffer_.data() + begin_, count, to);
    begin_ += count;
    return static_cast<ssize_t>(count);
  }

  ssize_t write(const char* from, size_t size) override {
    if (write_due_ == Clock::time_point() || written_ >= kWriteBytes) {
      write_due_ = Clock::now() + kWrite;
      written_ = 0;
    }
    if (!wait(socket_, POLLOUT, write_due_)) return -1;
    const ssize_t count = ::send(socket_, from, std::min(size, kWriteBytes), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0) return errno == EAGAIN || errno == EINTR ? 0 : -1;
    written_ += static_cast<std::size_t>(count);
    return count;
  }

  void get_remote_ip_and_port(std::string& ip, int& port) const override { name(::getpeername, ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { name(::getsockname, ip, port); }
  socket_t socket() const override { return socket_; }

 private:
  template <class Call>
  void name(Call call, std::string& ip, int& port) const {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    std::array<char, NI_MAXHOST> host{};
    std::array<char, NI_MAXSERV> service{};
    if (call(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return;
    if (::getnameinfo(reinterpret_cast<sockaddr*>(&address), size, host.data(), host.size(), service.data(),
                      service.size(), NI_NUMERICHOST | NI_NUMERICSERV) != 0)
      return;
    ip = host.data();
    port = std::atoi(service.data());
  }

  socket_t socket_;
  std::atomic<int>& waiting_;
  bool counted_ = false;
  std::array<char, 4096> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  ///< what of it was not read yet
  Clock::time_point deadline_{}, write_due_{};
  std::size_t written_ = 0;
};

}  // namespace

bool Connections::process_and_close_socket(socket_t socket) {
  TimedStream stream(socket, waiting_);
  bool done = true, closed = false;
  for (int left = kRequestsMax; done && !closed && left > 0 && stream.begin(); --left) {
    const auto has_head = [&](const httplib::Request& request) {
      if (!request.has_header("Content-Length") && !request.has_header("Transfer-Encoding")) stream.finish_reading();
    };
    done = process_request(stream, left == 1, closed, has_head);
    stream.finish_reading();
  }
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
  return done;
}

}  // namespace slsd::web
