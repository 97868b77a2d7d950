// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/gate.hpp"

#include <algorithm>
#include <utility>

namespace slsd::web {
namespace {

constexpr std::string_view kBearer = "bearer ";

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return result;
}

std::string without_port(std::string_view host) {
  const std::size_t bracket = host.rfind(']'), colon = host.rfind(':');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket))
    host = host.substr(0, colon);
  return lower(host);
}

/// Removes a default port: "scanner:80" is "scanner" over HTTP, "scanner:443" over HTTPS.
std::string without_usual_port(std::string_view host, std::string_view scheme) {
  const std::string_view usual = scheme == "https" ? ":443" : ":80";
  return lower(host.ends_with(usual) ? host.substr(0, host.size() - usual.size()) : host);
}

bool is_of_this_origin(const Request& request) {
  if (!request.site.empty() && request.site != "same-origin") return false;
  if (request.origin.empty()) return true;
  const std::size_t end = request.origin.find("://");
  if (end == std::string::npos) return false;
  const std::string_view origin = request.origin, scheme = origin.substr(0, end);
  return without_usual_port(origin.substr(end + 3), scheme) == without_usual_port(request.host, scheme);
}

}  // namespace

std::optional<Refusal> Gate::check_host(const Request& request) const {
  const std::string name = without_port(request.host);
  const bool address = name == request.local_address || name == "[" + request.local_address + "]";
  if (address || std::ranges::find(names_, name) != names_.end()) return std::nullopt;
  return Refusal{403, "unknown_host",
                 "the page is not served under this name: use the address that slsd-web listens on, or start slsd-web "
                 "with --name"};
}

std::optional<Refusal> Gate::check_origin(const Request& request) const {
  if (auto refused = check_host(request)) return refused;
  if (is_of_this_origin(request)) return std::nullopt;
  return Refusal{403, "not_from_the_page",
                 "only the page itself may request this; a proxy must pass on the header Host with its port"};
}

std::optional<Refusal> Gate::check(const Request& request, Clock::time_point now) {
  if (auto refused = check_origin(request)) return refused;
  const std::lock_guard lock(mutex_);
  const std::string_view authorization = request.authorization;
  if (lower(authorization.substr(0, kBearer.size())) == kBearer)  // a scheme's name may have capitals or not
    return check_token(request.address, authorization.substr(kBearer.size()), now);
  if (knows(request, now)) return std::nullopt;
  return Refusal{401, "no_token",
                 "open the address that slsd-web printed when it started, or enter the token of this scanner"};
}

// All cookies of the name count, because a browser may send those of two scanners under one host name.
bool Gate::knows(const Request& request, Clock::time_point now) {
  std::erase_if(sessions_, [&](const Known& session) { return now - session.used > kSession; });
  std::string_view rest = request.cookie;
  while (!rest.empty()) {
    std::string_view pair = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    pair.remove_prefix(std::min(pair.size(), pair.find_first_not_of(' ')));
    if (!pair.starts_with(cookie_name_ + "=")) continue;
    const std::string_view id = pair.substr(cookie_name_.size() + 1);
    for (Known& session : sessions_) {
      if (!same_secret(session.id, id) || !same_secret(session.key, request.page_key)) continue;
      session.used = now;
      return true;
    }
  }
  return false;
}

std::optional<Refusal> Gate::check_token(const std::string& address, std::string_view token, Clock::time_point now) {
  switch (tokens_.check(address, token, now)) {
    case TokenCheck::Verdict::kRight:
      return std::nullopt;
    case TokenCheck::Verdict::kWait:
      return Refusal{429, "too_many_tokens", "too many wrong tokens: wait half a minute"};
    case TokenCheck::Verdict::kWrong:
      break;
  }
  return Refusal{401, "wrong_token",
                 tokens_.token().chosen
                     ? "that is not the token of this scanner"
                     : "that is not the token of this scanner; slsd-web makes a new one whenever it starts"};
}

tl::expected<Session, Refusal> Gate::log_in(const std::string& address, std::string_view token, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (auto refused = check_token(address, token, now)) return tl::unexpected(std::move(*refused));
  if (sessions_.size() >= kSessionsMax) {
    sessions_.erase(std::ranges::min_element(sessions_, {}, [](const Known& session) { return session.used; }));
  }
  const Known& made = sessions_.emplace_back(Known{random_secret(), random_secret(), now});
  return Session{cookie_name_ + "=" + made.id + "; HttpOnly; SameSite=Strict; Max-Age=1209600", made.key};
}

}  // namespace slsd::web
