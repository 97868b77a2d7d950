// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/code/key_reader.hpp"

#include <algorithm>

#include "core/code/nearest_key.hpp"

namespace slsd {
namespace {

const toml::table kNoTable;
const toml::array kNoArray;

std::string quoted(std::string_view key) {
  return '"' + std::string(key) + '"';
}

}  // namespace

void KeyReader::refuse(const toml::node& node, ErrorCode code, std::string message) {
  if (!error_) error_ = Error{code, std::move(message), file_name_ + ":" + std::to_string(node.source().begin.line)};
}

void KeyReader::only(const toml::table& table, std::span<const std::string_view> known) {
  for (const auto& [key, node] : table)
    if (std::ranges::find(known, key.str()) == known.end() && !error_)
      error_ = Error{ErrorCode::kMalformed,
                     "unknown key " + quoted(key.str().substr(0, 64)) + "; the nearest known one is " +
                         quoted(nearest_key(key.str(), known)),
                     file_name_ + ":" + std::to_string(key.source().begin.line)};
}

const toml::node* KeyReader::required(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (node == nullptr) refuse(table, ErrorCode::kMalformed, "the key " + quoted(key) + " is missing here");
  return node;
}

const toml::table& KeyReader::table(const toml::table& parent, std::string_view key) {
  const toml::node* node = required(parent, key);
  if (node == nullptr) return kNoTable;
  if (node->is_table()) return *node->as_table();
  refuse(*node, ErrorCode::kMalformed, quoted(key) + " must be a table");
  return kNoTable;
}

std::int64_t KeyReader::integer(const toml::table& table, std::string_view key, std::int64_t low, std::int64_t high) {
  const toml::node* node = required(table, key);
  if (node == nullptr) return low;
  if (const auto value = node->value_exact<std::int64_t>(); value && *value >= low && *value <= high) return *value;
  refuse(*node, node->is_integer() ? ErrorCode::kInvalidArgument : ErrorCode::kMalformed,
         quoted(key) + " must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return low;
}

bool KeyReader::boolean(const toml::table& table, std::string_view key) {
  const toml::node* node = required(table, key);
  if (node == nullptr) return false;
  if (const auto value = node->value_exact<bool>()) return *value;
  refuse(*node, ErrorCode::kMalformed, quoted(key) + " must be true or false");
  return false;
}

std::string KeyReader::string(const toml::table& table, std::string_view key) {
  const toml::node* node = required(table, key);
  if (node == nullptr) return {};
  if (auto value = node->value_exact<std::string>()) return *value;
  refuse(*node, ErrorCode::kMalformed, quoted(key) + " must be a string");
  return {};
}

const toml::array& KeyReader::array(const toml::table& table, std::string_view key, std::size_t at_most) {
  const toml::node* node = required(table, key);
  if (node == nullptr) return kNoArray;
  if (node->is_array() && node->as_array()->size() <= at_most) return *node->as_array();
  refuse(*node, ErrorCode::kMalformed, quoted(key) + " must be a list of at most " + std::to_string(at_most));
  return kNoArray;
}

std::vector<int> KeyReader::integers(const toml::table& table, std::string_view key, std::size_t at_most) {
  std::vector<int> values;
  for (const toml::node& node : array(table, key, at_most)) {
    const auto value = node.value_exact<std::int64_t>();
    if (!value || *value != static_cast<int>(*value))
      refuse(node, ErrorCode::kMalformed, quoted(key) + " must list small whole numbers");
    values.push_back(static_cast<int>(value.value_or(0)));
  }
  return values;
}

std::vector<std::string> KeyReader::strings(const toml::table& table, std::string_view key, std::size_t at_most) {
  std::vector<std::string> values;
  for (const toml::node& node : array(table, key, at_most)) {
    if (!node.is_string()) refuse(node, ErrorCode::kMalformed, quoted(key) + " must list strings");
    values.push_back(node.value_exact<std::string>().value_or(""));
  }
  return values;
}

}  // namespace slsd
