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

namespace slsd::web {

/// Why a request is not answered.
struct Refusal {
  int status;  ///< of HTTP
  std::string name;
  std::string message;  ///< what to do
};

/// What of a request says who sent it.
struct Asker {
  std::string address;  ///< where it came from
  std::string host;     ///< header Host
  std::string origin;   ///< header Origin; empty: none
  std::string site;     ///< header Sec-Fetch-Site; empty: none
  std::string cookie;   ///< header Cookie
  bool from_page = false;
};

/// Who is let in. The page is asked for by its own names alone, so that no name which somebody else's server answers
/// for leads here; everything else is asked for by the page alone, which says so in a header that no other site's
/// script can send; and where there is a token, after it was shown once.
/// @thread thread-safe
class Gate {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kWrongMax = 5;  ///< tokens of one address, before it has to wait
  static constexpr std::chrono::seconds kWait{30};
  static constexpr std::chrono::hours kSession{24 * 14};  ///< since it was last used
  static constexpr std::size_t kSessionsMax = 64, kAddressesMax = 1024;

  /// @param names  by which the page may be asked for, without ports
  /// @param token  empty: none is wanted
  Gate(std::vector<std::string> names, std::string token) : names_(std::move(names)), token_(std::move(token)) {}

  [[nodiscard]] std::optional<Refusal> check_host(const Asker& asker) const;
  /// Of a request that only the page sends. @param open  also before a token was shown
  [[nodiscard]] std::optional<Refusal> check(const Asker& asker, bool open, Clock::time_point now = Clock::now());
  /// @return a session's cookie for the right token
  [[nodiscard]] std::optional<std::string> log_in(const std::string& address, std::string_view token, Refusal& refusal,
                                                  Clock::time_point now = Clock::now());
  [[nodiscard]] bool wants_token() const { return !token_.empty(); }

 private:
  struct Session {
    std::string id;
    Clock::time_point used;
  };
  [[nodiscard]] bool knows(std::string_view cookie, Clock::time_point now);

  std::vector<std::string> names_;
  std::string token_;
  std::mutex mutex_;
  std::deque<Session> sessions_;
  std::map<std::string, std::deque<Clock::time_point>> wrong_;  ///< tokens of late, by address
};

}  // namespace slsd::web
