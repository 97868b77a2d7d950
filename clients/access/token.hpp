// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace slsd {

/// Compares two secrets in constant time, so that timing does not reveal where they differ. An empty one equals none.
[[nodiscard]] bool same_secret(std::string_view a, std::string_view b);

/// 192 random bits from the kernel, as 48 hexadecimal digits.
[[nodiscard]] std::string random_secret();

/// The secret that admits programs and people from the network.
struct Token {
  std::string text;
  bool chosen = false;  ///< a person chose it: it may be guessed, and remains after this run
};

/// A token for this run.
[[nodiscard]] Token random_token();

/// Reads a token that a person chose, without white space at its end.
/// @errors kInvalidArgument: shorter than 16 characters; those of read_file()
[[nodiscard]] Result<Token> read_token(const std::filesystem::path& file);

/// Checks tokens, and slows down those who guess: after five wrong ones an address must wait.
/// @thread thread-bound
class TokenCheck {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Verdict { kRight, kWrong, kWait };
  static constexpr int kWrongMax = 5;  ///< wrong tokens from one address before it must wait; for chosen tokens
  static constexpr std::chrono::seconds kWait{30};
  static constexpr std::size_t kAddressesMax = 1024;

  explicit TokenCheck(Token token) : token_(std::move(token)) {}

  [[nodiscard]] Verdict check(const std::string& address, std::string_view token, Clock::time_point now);
  [[nodiscard]] const Token& token() const { return token_; }

 private:
  Token token_;
  std::map<std::string, std::deque<Clock::time_point>> wrong_;  ///< times of recent wrong tokens, by address
};

}  // namespace slsd
