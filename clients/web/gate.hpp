// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/access/token.hpp"
#include "clients/web/request.hpp"

namespace slsd::web {

/// The secret of a browser that has shown the token. It needs both halves: browsers send the cookie to every port of
/// this host, but only scripts of this origin know the key.
struct Session {
  std::string cookie;  ///< value of the header Set-Cookie; its path is the page's, even behind a proxy
  std::string key;     ///< value of the header X-Slsd-Page
};

/// Decides who is admitted. Serves the page only under its own names, so that no foreign domain name leads here. All
/// other requests need a secret: the token, or a session obtained with it.
/// @thread thread-safe
class Gate {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::hours kSession{24 * 14};  ///< lifetime since its last use
  static constexpr std::size_t kSessionsMax = 64;

  /// @param names        host names of the page, without ports; the addresses that it listens at are always valid
  /// @param cookie_name  different for each port, because browsers do not separate the cookies of ports
  Gate(std::vector<std::string> names, Token token, std::string cookie_name)
      : names_(std::move(names)), cookie_name_(std::move(cookie_name)), tokens_(std::move(token)) {}

  [[nodiscard]] std::optional<Refusal> check_host(const Request& request) const;
  /// Judges a request that reads data or acts. @return the refusal, if any
  [[nodiscard]] std::optional<Refusal> check(const Request& request, Clock::time_point now = Clock::now());
  /// Judges the origin of a request that brings a token. @return a refusal if another origin sent it
  [[nodiscard]] std::optional<Refusal> check_origin(const Request& request) const;
  /// @return a session for the right token
  [[nodiscard]] tl::expected<Session, Refusal> log_in(const std::string& address, std::string_view token,
                                                      Clock::time_point now = Clock::now());

 private:
  struct Known {
    std::string id, key;
    Clock::time_point used;
  };
  [[nodiscard]] std::optional<Refusal> check_token(const std::string& address, std::string_view token,
                                                   Clock::time_point now);
  [[nodiscard]] bool knows(const Request& request, Clock::time_point now);

  std::vector<std::string> names_;
  std::string cookie_name_;
  std::mutex mutex_;  ///< guards the two below
  TokenCheck tokens_;
  std::deque<Known> sessions_;
};

}  // namespace slsd::web
