// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <slsd/connection.hpp>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// A line from the daemon and the bytes that came with it.
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

/// The client library's connection for slsctl: JSON that is parsed, errors as values. Waits as long as the daemon
/// works, unless told otherwise.
/// @thread thread-bound
class Connection {
 public:
  /// @errors kNotFound: no daemon answers at this path; kPermissionDenied; kInvalidArgument: too long a path; kIo
  [[nodiscard]] static Result<Connection> open(const std::filesystem::path& socket);

  /// From now on at most so long for each message, to be sent or received; then kTimeout.
  void set_patience(std::chrono::seconds patience) { patience_ = patience; }

  /// Sends a request and waits for its reply, which may be a JSON-RPC error.
  /// @errors kDisconnected: the daemon hung up; kMalformed: it is no slsd; kIo
  [[nodiscard]] Result<Answered> call(std::string_view method, const nlohmann::json& params);

  /// Sends a request and does not wait; reply() does. @errors as call()
  [[nodiscard]] Result<> request(std::string_view method, const nlohmann::json& params);
  /// Waits for the reply to the oldest request that has none. @errors as call()
  [[nodiscard]] Result<Answered> reply();

  /// Waits for the next message. @errors as call()
  [[nodiscard]] Result<Received> receive();

 private:
  explicit Connection(client::Connection socket) : socket_(std::move(socket)) {}
  [[nodiscard]] client::Connection::Deadline deadline() const;

  client::Connection socket_;
  std::optional<std::chrono::seconds> patience_;
};

}  // namespace slsd
