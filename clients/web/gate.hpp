// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/web/request.hpp"

namespace slsd::web {

/// The secret that lets browsers and scripts in.
struct Token {
  std::string text;
  bool chosen = false;  ///< a person chose it: it might be guessed, and outlives this run
};

/// A token of this run, from the kernel's random numbers: 192 bits.
[[nodiscard]] Token random_token();

/// The secret of a browser that has shown the token. Both halves are needed: browsers send the cookie to every port of
/// this machine's name, the key only by a script of this very origin.
struct Session {
  std::string cookie;  ///< value of the header Set-Cookie; its path is that of the page, wherever a proxy puts it
  std::string key;     ///< value of the header X-Slsd-Page
};

/// Decides who is let in. The page is served under its own names only, so that no name of somebody else's domain leads
/// here. Everything else needs a secret: the token, or a session that was given for it.
/// @thread thread-safe
class Gate {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kWrongMax = 5;  ///< wrong tokens of one address, before it has to wait; of chosen tokens
  static constexpr std::chrono::seconds kWait{30};
  static constexpr std::chrono::hours kSession{24 * 14};  ///< lifetime since its last use
  static constexpr std::size_t kSessionsMax = 64, kAddressesMax = 1024;

  /// @param names        by which the page may be asked for, without ports; an address at which it listens may always
  /// @param cookie_name  another for each port: browsers do not keep the cookies of ports apart
  Gate(std::vector<std::string> names, Token token, std::string cookie_name)
      : names_(std::move(names)), token_(std::move(token)), cookie_name_(std::move(cookie_name)) {}

  [[nodiscard]] std::optional<Refusal> check_host(const Request& request) const;
  /// Judges a request that shows data or acts. @return the refusal, if any
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
  Token token_;
  std::string cookie_name_;
  std::mutex mutex_;
  std::deque<Known> sessions_;
  std::map<std::string, std::deque<Clock::time_point>> wrong_;  ///< tokens of late, by address
};

}  // namespace slsd::web
