// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <slsd/connection.hpp>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// A line from the service and the bytes that came with it.
struct Received {
  nlohmann::json message;
  client::Bytes bytes;

  /// Views the bytes as raw pixels of 8 or 16 bits; valid as long as the bytes.
  /// @param about  the part of the message that describes them: `width_px`, `height_px`, `bits`
  /// @errors kMalformed: the number of bytes does not match
  [[nodiscard]] Result<GreyView> image(const nlohmann::json& about) const;
};

/// A reply, and the events that came before it.
struct Answered {
  Received reply;
  std::vector<Received> events;
};

/// The client library's connection for slsctl, with parsed JSON and errors as values. Waits as long as the service
/// works, unless limited. After a long silence, asks on a second connection whether the service is alive.
/// @thread thread-bound
class Connection {
 public:
  using Waiting = std::function<void(std::chrono::steady_clock::duration)>;

  /// @errors kNotFound: no service answers at this path; kPermissionDenied; kInvalidArgument: the path is too long; kIo
  [[nodiscard]] static Result<Connection> open(const std::filesystem::path& socket);

  /// Limits the time to send or receive each message from now on; then kTimeout.
  void set_timeout(std::chrono::seconds timeout) { timeout_ = timeout; }
  /// Sets a function that is called a few times a second while an answer is awaited, with the waiting time so far.
  void set_waiting(Waiting waiting) { waiting_ = std::move(waiting); }

  /// Sends a request and waits for its reply, which may be a JSON-RPC error.
  /// @errors kDisconnected: the service hung up; kTimeout: it hangs; kMalformed: it is not slsd; kIo
  [[nodiscard]] Result<Answered> call(std::string_view method, const nlohmann::json& params);

  /// Sends a request without waiting; reply() waits. @errors as call()
  [[nodiscard]] Result<> request(std::string_view method, const nlohmann::json& params);
  /// Waits for the reply to the oldest open request. @errors as call()
  [[nodiscard]] Result<Answered> reply();

  /// Waits for the next message. @errors as call()
  [[nodiscard]] Result<Received> receive();

 private:
  Connection(client::Connection socket, std::filesystem::path path)
      : socket_(std::move(socket)), path_(std::move(path)) {}
  [[nodiscard]] client::Connection::Deadline deadline() const;
  [[nodiscard]] Result<> await_answer() const;

  client::Connection socket_;
  std::filesystem::path path_;
  std::optional<std::chrono::seconds> timeout_;
  Waiting waiting_;
};

}  // namespace slsd
