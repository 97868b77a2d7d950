// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/access/token.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <utility>

#include "drivers/files/file.hpp"

namespace slsd {
namespace {

constexpr std::size_t kTokenBytesMin = 16, kTokenBytesMax = 1024;

}  // namespace

bool same_secret(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % std::max<std::size_t>(b.size(), 1)]);
  return difference == 0 && !b.empty();
}

std::string random_secret() {
  std::array<unsigned char, 24> bytes{};
  // This few bytes come whole, or never if the kernel has no random numbers; then nobody may enter.
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) std::abort();
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4U];
    text += "0123456789abcdef"[byte & 15U];
  }
  return text;
}

Token random_token() {
  return {random_secret(), /*chosen=*/false};
}

Result<Token> read_token(const std::filesystem::path& file) {
  auto text = read_file(file, kTokenBytesMax);
  if (!text) return tl::unexpected(text.error());
  while (!text->empty() && std::isspace(static_cast<unsigned char>(text->back())) != 0) text->pop_back();
  if (text->size() >= kTokenBytesMin) return Token{std::move(*text), /*chosen=*/true};
  return fail(ErrorCode::kInvalidArgument, "a token must have 16 characters or more", file.string());
}

TokenCheck::Verdict TokenCheck::check(const std::string& address, std::string_view token, Clock::time_point now) {
  std::erase_if(wrong_, [&](const auto& each) { return now - each.second.back() > kWait; });
  const auto before = wrong_.find(address);
  if (before != wrong_.end() && before->second.size() >= kWrongMax) return Verdict::kWait;
  if (same_secret(token, token_.text)) {
    if (before != wrong_.end()) wrong_.erase(before);
    return Verdict::kRight;
  }
  if (token_.chosen && (before != wrong_.end() || wrong_.size() < kAddressesMax)) wrong_[address].push_back(now);
  return Verdict::kWrong;
}

}  // namespace slsd
