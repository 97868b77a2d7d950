// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace slsd::client {

/// Received bytes, in memory shared with the service or in the process's own. Copies share them; nobody changes them.
/// @thread reentrant
class Bytes {
 public:
  Bytes() = default;
  explicit Bytes(std::string own);
  /// @param memory  keeps `view` alive
  Bytes(std::shared_ptr<const void> memory, std::string_view view) : memory_(std::move(memory)), view_(view) {}

  [[nodiscard]] const char* data() const { return view_.data(); }
  [[nodiscard]] std::size_t size() const { return view_.size(); }
  [[nodiscard]] bool empty() const { return view_.empty(); }
  [[nodiscard]] std::string_view view() const { return view_; }
  operator std::string_view() const { return view_; }  // NOLINT(google-explicit-constructor): they are read as a text

 private:
  std::shared_ptr<const void> memory_;
  std::string_view view_;
};

/// The socket that clients connect to unless told otherwise: SLSD_SOCKET in the environment, else the usual place.
/// @thread reentrant while nobody changes the environment
[[nodiscard]] std::string default_socket();

/// One line of the protocol, and the data that came with it.
struct Message {
  std::string json;
  Bytes bytes;  ///< after the line, or in a memfd
};

/// The protocol without its meaning, for requests that Scanner has no method for: lines of JSON, the bytes after them,
/// memfds. After any error the connection is unusable, because later data would seem to answer the next request. A
/// forked child shares its parent's connection: there send() and receive() throw, and the destructor leaves the
/// parent's open.
/// @thread thread-bound
class Connection {
 public:
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  /// @throws NoService, PermissionDenied, ConnectionLost, TimedOut
  explicit Connection(const std::string& socket);
  ~Connection();
  Connection(Connection&&) noexcept;
  Connection& operator=(Connection&&) noexcept;

  /// Sends a request; returns its id.
  /// @param params    a JSON object
  /// @param deadline  time by which the service must have read it; nothing: wait while the service exists
  /// @throws ConnectionLost, TimedOut
  std::int64_t send(std::string_view method, std::string_view params, Deadline deadline = {});

  /// Waits until a part of the next message has arrived, at most until the deadline. @return whether it has
  /// @throws ConnectionLost
  [[nodiscard]] bool answers(Deadline deadline) const;

  /// Waits for the next message: a reply, which may be an error, or an event.
  /// @throws ConnectionLost, TimedOut, ProtocolError
  [[nodiscard]] Message receive(Deadline deadline = {});

  /// Tells whether this process opened the connection, not a parent.
  [[nodiscard]] bool is_own() const;

 private:
  void refuse_others() const;
  [[nodiscard]] bool ready(short events, const Deadline& deadline) const;
  void wait(short events, const Deadline& deadline) const;
  void receive_more(const Deadline& deadline);
  [[nodiscard]] std::string receive_line(const Deadline& deadline);
  [[nodiscard]] Bytes receive_bytes(std::size_t count, const Deadline& deadline);
  [[nodiscard]] Bytes map_descriptor(std::size_t size);
  void close() noexcept;

  std::string path_;
  int socket_ = -1;
  std::string buffer_;
  std::vector<int> descriptors_;  ///< received but not mapped yet
  std::int64_t last_id_ = 0;
  int process_ = 0;  ///< the process that opened the connection
};

}  // namespace slsd::client
