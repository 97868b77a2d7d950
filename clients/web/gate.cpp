// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/gate.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace slsd::web {
namespace {

constexpr std::string_view kCookie = "slsd_session=";

/// In a time that does not tell where they differ.
bool same(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % std::max<std::size_t>(b.size(), 1)]);
  return difference == 0 && !b.empty();
}

std::string random_id() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4U];
    text += "0123456789abcdef"[byte & 15U];
  }
  return text;
}

std::string without_port(std::string_view host) {
  const std::size_t bracket = host.rfind(']'), colon = host.rfind(':');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket))
    host = host.substr(0, colon);
  std::string name(host);
  std::ranges::transform(name, name.begin(),
                         [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return name;
}

}  // namespace

std::optional<Refusal> Gate::check_host(const Asker& asker) const {
  if (std::ranges::find(names_, without_port(asker.host)) != names_.end()) return std::nullopt;
  return Refusal{403, "unknown_host",
                 "the page is not served under this name: ask for it by the address that it listens at, or start "
                 "slsd-web with --name"};
}

std::optional<Refusal> Gate::check(const Asker& asker, bool open, Clock::time_point now) {
  if (auto refused = check_host(asker)) return refused;
  const std::size_t scheme = asker.origin.find("://");
  const bool other_origin =
      !asker.origin.empty() &&
      (scheme == std::string::npos || without_port(asker.origin.substr(scheme + 3)) != without_port(asker.host));
  const bool other_site = !asker.site.empty() && asker.site != "same-origin";
  if (other_origin || other_site || !asker.from_page)
    return Refusal{403, "not_from_the_page", "only the page itself may ask for this (header X-Slsd-Page)"};
  if (open || token_.empty()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (knows(asker.cookie, now)) return std::nullopt;
  return Refusal{401, "no_token", "enter the token of this scanner"};
}

bool Gate::knows(std::string_view cookie, Clock::time_point now) {
  std::erase_if(sessions_, [&](const Session& session) { return now - session.used > kSession; });
  const std::size_t at = cookie.find(kCookie);
  if (at == std::string_view::npos) return false;
  std::string_view id = cookie.substr(at + kCookie.size());
  id = id.substr(0, id.find(';'));
  for (Session& session : sessions_) {
    if (!same(session.id, id)) continue;
    session.used = now;
    return true;
  }
  return false;
}

std::optional<std::string> Gate::log_in(const std::string& address, std::string_view token, Refusal& refusal,
                                        Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::erase_if(wrong_, [&](const auto& each) { return now - each.second.back() > kWait; });
  const auto before = wrong_.find(address);
  if (before != wrong_.end() && before->second.size() >= kWrongMax) {
    refusal = {429, "too_many_tokens", "too many wrong tokens: wait half a minute"};
    return std::nullopt;
  }
  if (!same(token, token_)) {
    if (before != wrong_.end() || wrong_.size() < kAddressesMax) wrong_[address].push_back(now);
    refusal = {401, "wrong_token", "that is not the token of this scanner"};
    return std::nullopt;
  }
  wrong_.erase(address);
  if (sessions_.size() >= kSessionsMax) {
    sessions_.erase(std::ranges::min_element(sessions_, {}, [](const Session& session) { return session.used; }));
  }
  sessions_.push_back({random_id(), now});
  return std::string(kCookie) + sessions_.back().id + "; HttpOnly; SameSite=Strict; Path=/; Max-Age=1209600";
}

}  // namespace slsd::web
