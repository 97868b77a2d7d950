// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/toml/table_reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLongestList = 64;

}  // namespace

std::string place_of(const toml::source_region& source, std::string_view file) {
  return std::string(file) + ":" + std::to_string(source.begin.line) + ":" + std::to_string(source.begin.column);
}

TableReader::TableReader(const toml::table* table, std::string name, std::filesystem::path file)
    : table_(table), name_(std::move(name)), file_(std::move(file)) {}

bool TableReader::has(std::string_view key) const {
  return table_ != nullptr && table_->contains(key);
}

const toml::node* TableReader::find(std::string_view key) {
  known_.emplace_back(key);
  return table_ == nullptr ? nullptr : table_->get(key);
}

std::string TableReader::place(std::string_view key) const {
  if (table_ == nullptr) return file_.string();
  const toml::node* node = table_->get(key);
  return place_of(node == nullptr ? table_->source() : node->source(), file_.string());
}

void TableReader::refuse(std::string_view key, std::string_view what) {
  known_.emplace_back(key);
  if (error_) return;
  const std::string prefix = name_.empty() ? "" : name_ + " ";
  error_ = Error{ErrorCode::kInvalidArgument, prefix + std::string(key) + " " + std::string(what), place(key)};
}

std::optional<std::int64_t> TableReader::integer(std::string_view key, std::int64_t low, std::int64_t high) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto* number = node->as_integer();
  if (number != nullptr && number->get() >= low && number->get() <= high) return number->get();
  refuse(key, "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return std::nullopt;
}

void TableReader::read(std::string_view key, bool& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto* boolean = node->as_boolean()) {
    value = boolean->get();
  } else {
    refuse(key, "must be true or false");
  }
}

void TableReader::read(std::string_view key, std::optional<bool>& value) {
  bool given = false;
  read(key, given);
  if (has(key)) value = given;
}

void TableReader::read(std::string_view key, int& value) {
  using Limits = std::numeric_limits<int>;
  if (const auto number = integer(key, Limits::min(), Limits::max())) value = static_cast<int>(*number);
}

void TableReader::read(std::string_view key, std::uint32_t& value) {
  const auto number = integer(key, 0, std::numeric_limits<std::uint32_t>::max());
  if (number) value = static_cast<std::uint32_t>(*number);
}

void TableReader::read(std::string_view key, std::optional<int>& value) {
  using Limits = std::numeric_limits<int>;
  if (const auto number = integer(key, Limits::min(), Limits::max())) value = static_cast<int>(*number);
}

void TableReader::read(std::string_view key, double& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const auto number = node->value<double>();
  if (number && std::isfinite(*number)) {
    value = *number;
  } else {
    refuse(key, "must be a number");
  }
}

void TableReader::read(std::string_view key, std::optional<double>& value) {
  double number = 0.0;
  read(key, number);
  if (has(key)) value = number;
}

void TableReader::read(std::string_view key, std::string& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const auto* text = node->as_string();
  if (text != nullptr && text->get().find('\0') == std::string::npos) {
    value = text->get();
  } else {
    refuse(key, "must be a string in quotes");
  }
}

void TableReader::read(std::string_view key, std::filesystem::path& value) {
  std::string text;
  read(key, text);
  if (!text.empty()) value = file_.parent_path() / text;
}

void TableReader::read(std::string_view key, std::vector<int>& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  std::vector<int> numbers;
  for (std::size_t i = 0; array != nullptr && i < std::min(array->size(), kLongestList); ++i) {
    const auto number = array->get(i)->value_exact<std::int64_t>();
    if (number && std::in_range<int>(*number)) numbers.push_back(static_cast<int>(*number));
  }
  if (array == nullptr || numbers.size() != array->size()) return refuse(key, "must be a list of whole numbers");
  value = std::move(numbers);
}

void TableReader::read(std::string_view key, std::vector<std::string>& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  std::vector<std::string> words;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if (auto word = array->get(i)->value_exact<std::string>()) words.push_back(std::move(*word));
  }
  if (array == nullptr || words.size() != array->size()) return refuse(key, "must be a list of strings");
  value = std::move(words);
}

void TableReader::read(std::string_view key, std::vector<double>& value) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  std::vector<double> numbers;
  for (std::size_t i = 0; i < (array == nullptr ? 1 : std::min(array->size(), kLongestList)); ++i) {
    const auto number = (array == nullptr ? *node : *array->get(i)).value<double>();
    if (number && std::isfinite(*number)) numbers.push_back(*number);
  }
  if (numbers.size() != (array == nullptr ? 1 : array->size())) {
    return refuse(key, "must be a number or a list of numbers");
  }
  value = std::move(numbers);
}

void TableReader::read_both(std::string_view first_key, std::string_view second_key,
                            std::optional<std::pair<int, int>>& values) {
  std::optional<int> first;
  std::optional<int> second;
  read(first_key, first);
  read(second_key, second);
  if (first && second) values = {*first, *second};
  if (first && !second) refuse(first_key, "needs " + std::string(second_key) + " beside it");
  if (second && !first) refuse(second_key, "needs " + std::string(first_key) + " beside it");
}

const toml::table* TableReader::table(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return nullptr;
  if (!node->is_table()) refuse(key, "must be a table: write [" + std::string(key) + "]");
  return node->as_table();
}

std::vector<const toml::table*> TableReader::tables(std::string_view key) {
  const toml::node* node = find(key);
  std::vector<const toml::table*> found;
  if (node == nullptr) return found;
  const toml::array* array = node->as_array();
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if (const toml::table* table = array->get(i)->as_table()) found.push_back(table);
  }
  if (array == nullptr || found.size() != array->size()) {
    refuse(key, "must be a list of tables: write [[" + std::string(key) + "]]");
  }
  return found;
}

std::optional<Error> TableReader::unknown_key() const {
  if (table_ == nullptr) return std::nullopt;
  for (const auto& [key, node] : *table_) {
    if (std::ranges::find(known_, key.str()) != known_.end()) continue;
    const std::string what = name_.empty() ? "no such table or key: " : "no such key in " + name_ + ": ";
    std::string hint = nearest_hint(key.str(), known_);
    if (hint.empty()) hint = "; this is slsd " SLSD_VERSION ": is the configuration for another version?";
    return Error{ErrorCode::kInvalidArgument, what + printable(key.str(), 64) + hint,
                 place_of(key.source(), file_.string())};
  }
  return std::nullopt;
}

std::string TableReader::place_named_by(std::string_view message) const {
  std::string_view named;
  std::size_t first = std::string_view::npos;
  for (const std::string& key : known_) {
    const std::size_t at = message.find(key);
    const bool better = at < first || (at == first && key.size() > named.size());
    if (at != std::string_view::npos && better && has(key)) {
      named = key;
      first = at;
    }
  }
  return place(named);
}

Result<> TableReader::finish(Result<> valid) const {
  if (auto unknown = unknown_key()) return tl::unexpected(*unknown);
  if (error_) return tl::unexpected(*error_);
  if (valid) return {};
  // Options name the key in the error's place ("rate_hz", "decode.depth_min_mm") or in its message.
  const Error& error = valid.error();
  const std::string key = error.where.substr(error.where.find_last_of('.') + 1);
  const bool named = error.message.find(key) != std::string::npos;
  const std::string prefix = (name_.empty() ? "" : name_ + " ") + (named ? "" : key + " ");
  return fail(error.code, prefix + error.message, place_named_by(has(key) ? key : error.message));
}

}  // namespace slsd
