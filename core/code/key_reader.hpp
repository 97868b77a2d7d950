// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "core/result.hpp"

namespace slsd {

/// Reads typed keys of a TOML document and keeps the first error. After an error, every read returns a default, so that
/// a caller can read all its keys in a row and check error() once.
/// @thread thread-bound
class KeyReader {
 public:
  explicit KeyReader(std::string_view file_name) : file_name_(file_name) {}

  /// Rejects unknown keys, and suggests the nearest known one.
  void only(const toml::table& table, std::span<const std::string_view> known);
  [[nodiscard]] const toml::table& table(const toml::table& parent, std::string_view key);
  [[nodiscard]] std::int64_t integer(const toml::table& table, std::string_view key, std::int64_t low,
                                     std::int64_t high);
  [[nodiscard]] bool boolean(const toml::table& table, std::string_view key);
  [[nodiscard]] std::string string(const toml::table& table, std::string_view key);
  [[nodiscard]] std::vector<int> integers(const toml::table& table, std::string_view key, std::size_t at_most);
  [[nodiscard]] std::vector<std::string> strings(const toml::table& table, std::string_view key, std::size_t at_most);

  void refuse(const toml::node& node, ErrorCode code, std::string message);
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  [[nodiscard]] const toml::node* required(const toml::table& table, std::string_view key);
  [[nodiscard]] const toml::array& array(const toml::table& table, std::string_view key, std::size_t at_most);

  std::string file_name_;
  std::optional<Error> error_;
};

}  // namespace slsd
