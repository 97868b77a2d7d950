// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/param_reader.hpp"

#include <algorithm>
#include <cmath>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxQuotedBytes = 64;

}  // namespace

const nlohmann::json* ParamReader::find(const char* name) {
  known_.emplace_back(name);
  const auto found = params_.find(name);
  return found == params_.end() ? nullptr : &*found;
}

void ParamReader::refuse(const char* name, const std::string& what) {
  if (!error_) error_ = invalid_params("\"" + std::string(name) + "\" must be " + what);
}

bool ParamReader::boolean(const char* name, bool otherwise) {
  const auto* value = find(name);
  if (value == nullptr) return otherwise;
  if (value->is_boolean()) return value->get<bool>();
  refuse(name, "true or false");
  return otherwise;
}

int ParamReader::integer(const char* name, int otherwise, int low, int high) {
  const auto* value = find(name);
  if (value == nullptr) return otherwise;
  // Reads a double first: a number beyond 64 bits is read as one, and its conversion to int is undefined. JSON has one
  // type of number: 5000.0 is 5000.
  const double number = value->is_number() ? value->get<double>() : low - 1.0;
  if (number >= low && number <= high && std::trunc(number) == number) return static_cast<int>(number);
  refuse(name, "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return otherwise;
}

std::optional<double> ParamReader::number(const char* name, double low, double high) {
  const auto* value = find(name);
  if (value == nullptr) return std::nullopt;
  const double number = value->is_number() ? value->get<double>() : low - 1.0;
  if (number >= low && number <= high) return number;
  refuse(name, "a number from " + nlohmann::json(low).dump() + " to " + nlohmann::json(high).dump());
  return std::nullopt;
}

std::optional<std::vector<double>> ParamReader::numbers(const char* name, const NumberList& list) {
  const auto* value = find(name);
  if (value == nullptr) return std::nullopt;
  const auto fits = [&](const nlohmann::json& each) {
    return each.is_number() && each.get<double>() >= list.low && each.get<double>() <= list.high;
  };
  if (value->is_array() && value->size() >= list.count_min && value->size() <= list.count_max &&
      std::ranges::all_of(*value, fits))
    return value->get<std::vector<double>>();
  refuse(name, "a list of " + std::to_string(list.count_min) + " to " + std::to_string(list.count_max) +
                   " numbers from " + nlohmann::json(list.low).dump() + " to " + nlohmann::json(list.high).dump());
  return std::nullopt;
}

std::string ParamReader::text(const char* name, std::size_t bytes_max) {
  const auto* value = find(name);
  if (value == nullptr) return {};
  const std::size_t bytes = value->is_string() ? value->get_ref<const std::string&>().size() : 0;
  if (bytes > 0 && bytes <= bytes_max) return value->get<std::string>();
  refuse(name, "a string of 1 to " + std::to_string(bytes_max) + " bytes");
  return {};
}

std::string ParamReader::choice(const char* name, std::initializer_list<std::string_view> words) {
  const auto* value = find(name);
  if (value == nullptr) return std::string(*words.begin());
  if (value->is_string() && std::ranges::find(words, value->get_ref<const std::string&>()) != words.end()) {
    return value->get<std::string>();
  }
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "\"" : "\" or \"") + std::string(word);
  refuse(name, list + "\"");
  return std::string(*words.begin());
}

std::optional<RpcError> ParamReader::error() const {
  for (const auto& [name, value] : params_.items()) {
    if (std::ranges::find(known_, name) != known_.end()) continue;
    return invalid_params("no such parameter: \"" + printable(name, kMaxQuotedBytes) + "\"" +
                          nearest_hint(name, known_));
  }
  return error_;
}

}  // namespace slsd
