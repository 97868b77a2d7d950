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

  /// The bytes as raw pixels, 8 or 16 bits; it lives as long as they do.
  /// @param about  the message's part that describes them: `width_px`, `height_px`, `bits`
  /// @errors kMalformed: not as many bytes as that asks for
  [[nodiscard]] Result<GreyView> image(const nlohmann::json& about) const;
};

/// A reply, and the events that came before it.
struct Answered {
  Received reply;
  std::vector<Received> events;
};

/// The client library's connection for slsctl: JSON that is parsed, errors as values. Waits for as long as the service
/// works, unless told otherwise: if no answer comes for a while it asks on a second connection whether anybody is
/// there.
/// @thread thread-bound
class Connection {
 public:
  using Waiting = std::function<void(std::chrono::steady_clock::duration)>;

  /// @errors kNotFound: no service answers at this path; kPermissionDenied; kInvalidArgument: too long a path; kIo
  [[nodiscard]] static Result<Connection> open(const std::filesystem::path& socket);

  /// Limits the time to send or receive each message, from now on; then kTimeout.
  void set_patience(std::chrono::seconds patience) { patience_ = patience; }
  /// Calls this a few times a second while an answer is awaited, with the time since the waiting began.
  void set_waiting(Waiting waiting) { waiting_ = std::move(waiting); }

  /// Sends a request and waits for its reply, which may be a JSON-RPC error.
  /// @errors kDisconnected: the service hung up; kTimeout: it hangs; kMalformed: it is no slsd; kIo
  [[nodiscard]] Result<Answered> call(std::string_view method, const nlohmann::json& params);

  /// Sends a request and does not wait; reply() does. @errors as call()
  [[nodiscard]] Result<> request(std::string_view method, const nlohmann::json& params);
  /// Waits for the reply to the oldest request that has none. @errors as call()
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
  std::optional<std::chrono::seconds> patience_;
  Waiting waiting_;
};

}  // namespace slsd
