// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "core/result.hpp"

namespace slsd {

/// The place of a node, as "file:line:column".
[[nodiscard]] std::string place_of(const toml::source_region& source, std::string_view file);

/// Reads the keys of one TOML table into an options struct. A missing key keeps the default. The first wrong type is
/// kept until finish(), which also finds unknown keys.
/// @thread thread-bound
class TableReader {
 public:
  /// @param table  null if the table is missing
  /// @param name   as a user writes it, "[pattern]"; empty for the file's top level
  /// @param file   the file of the table; relative paths are relative to its folder
  TableReader(const toml::table* table, std::string name, std::filesystem::path file);

  [[nodiscard]] bool has(std::string_view key) const;
  void read(std::string_view key, bool& value);
  void read(std::string_view key, std::optional<bool>& value);
  void read(std::string_view key, int& value);
  void read(std::string_view key, std::uint32_t& value);
  void read(std::string_view key, std::optional<int>& value);
  void read(std::string_view key, double& value);
  void read(std::string_view key, std::optional<double>& value);
  void read(std::string_view key, std::string& value);
  void read(std::string_view key, std::filesystem::path& value);
  void read(std::string_view key, std::vector<int>& value);
  void read(std::string_view key, std::vector<std::string>& value);
  /// One number, or a list of them.
  void read(std::string_view key, std::vector<double>& value);

  /// Two numbers; each requires the other.
  void read_both(std::string_view first_key, std::string_view second_key, std::optional<std::pair<int, int>>& values);

  /// One of several words.
  /// @param choices  pairs of a word and its value
  template <class Value, std::ranges::forward_range Choices>
  void choose(std::string_view key, Value& value, const Choices& choices) {
    std::string word;
    read(key, word);
    if (word.empty() && !has(key)) return;
    for (const auto& [name, choice] : choices) {
      if (word == name) {
        value = choice;
        return;
      }
    }
    std::string names;
    for (const auto& choice : choices) (names += names.empty() ? "" : ", ") += choice.first;
    refuse(key, "must be one of " + names);
  }

  /// A subtable; null if missing.
  [[nodiscard]] const toml::table* table(std::string_view key);
  /// An array of subtables; empty if missing.
  [[nodiscard]] std::vector<const toml::table*> tables(std::string_view key);

  /// The keys requested so far, present or not.
  [[nodiscard]] const std::vector<std::string>& known() const { return known_; }

  /// Records that a key's value is wrong: "[pattern] seed must be ...".
  void refuse(std::string_view key, std::string_view what);

  /// The first error of the table: an unknown key, a wrong type, or the result of the options' validate(), placed at
  /// the key in its message.
  [[nodiscard]] Result<> finish(Result<> valid = {}) const;

 private:
  [[nodiscard]] const toml::node* find(std::string_view key);
  [[nodiscard]] std::string place(std::string_view key) const;
  [[nodiscard]] std::string place_named_by(std::string_view message) const;
  [[nodiscard]] std::optional<Error> unknown_key() const;
  std::optional<std::int64_t> integer(std::string_view key, std::int64_t low, std::int64_t high);

  const toml::table* table_;
  std::string name_;
  std::filesystem::path file_;
  std::vector<std::string> known_;
  std::optional<Error> error_;
};

}  // namespace slsd
