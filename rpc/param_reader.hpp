// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "rpc/message.hpp"

namespace slsd {

/// The longest text of a parameter, except file contents.
inline constexpr std::size_t kMaxTextBytes = 1024;

/// Limits of a list of numbers.
struct NumberList {
  std::size_t count_min, count_max;
  double low, high;
};

/// Reads a request's parameters by name. Missing ones keep their defaults; the first error is kept.
/// @thread thread-bound
class ParamReader {
 public:
  /// @param params  an object; must outlive the reader
  explicit ParamReader(const nlohmann::json& params) : params_(params) {}

  [[nodiscard]] bool boolean(const char* name, bool otherwise);
  [[nodiscard]] int integer(const char* name, int otherwise, int low, int high);
  /// The number of that name; empty if missing.
  [[nodiscard]] std::optional<double> number(const char* name, double low, double high);
  /// A text of 1 to this many bytes; empty if missing. It may contain control characters: use printable() before
  /// quoting it.
  [[nodiscard]] std::string text(const char* name, std::size_t bytes_max = kMaxTextBytes);
  /// The list of numbers of that name; nothing if missing.
  [[nodiscard]] std::optional<std::vector<double>> numbers(const char* name, const NumberList& list);
  /// One of the words; the first if missing.
  [[nodiscard]] std::string choice(const char* name, std::initializer_list<std::string_view> words);

  /// The first error: a wrong type, a value out of range, or an unknown name.
  [[nodiscard]] std::optional<RpcError> error() const;

 private:
  [[nodiscard]] const nlohmann::json* find(const char* name);
  void refuse(const char* name, const std::string& what);

  const nlohmann::json& params_;
  std::vector<std::string> known_;
  std::optional<RpcError> error_;
};

}  // namespace slsd
