// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/given_keys.hpp"

#include <string>

namespace slsd {
namespace {

using nlohmann::json;

json keys_of(const toml::table& table) {
  json keys = json::object();
  for (const auto& [key, value] : table) keys[std::string(key.str())] = given_keys(value);
  return keys;
}

json values_of(const toml::array& array) {
  json values = json::array();
  for (const toml::node& value : array) values.push_back(given_keys(value));
  return values;
}

}  // namespace

json given_keys(const toml::node& node) {
  if (const auto* table = node.as_table()) return keys_of(*table);
  if (const auto* array = node.as_array()) return values_of(*array);
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return number->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* flag = node.as_boolean()) return flag->get();
  return nullptr;
}

}  // namespace slsd
