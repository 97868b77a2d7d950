// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/request.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "core/printable.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxIdBytes = 256;
constexpr std::size_t kMaxQuotedNameBytes = 64;
constexpr double kExactBelow = 9007199254740992.0;  // 2^53. Beyond it, and beyond 64 bits, digits would be lost

tl::unexpected<BadRequest> refuse(json id, RpcError error) {
  return tl::unexpected(BadRequest{std::move(id), std::move(error)});
}

bool usable_as_id(const json& id) {
  if (id.is_number_float()) return std::abs(id.get<double>()) < kExactBelow;
  if (id.is_string()) return id.get_ref<const std::string&>().size() <= kMaxIdBytes;
  return id.is_null() || id.is_number();
}

// Moves a member out of the message, because it may be as long as the line.
json take(json& message, const char* name, json otherwise) {
  const auto found = message.find(name);
  return found == message.end() ? std::move(otherwise) : std::move(*found);
}

tl::expected<Request, BadRequest> read_members(json& message, json id) {
  if (const auto version = message.find("jsonrpc"); version == message.end() || *version != "2.0") {
    return refuse(id, invalid_request("\"jsonrpc\" must be \"2.0\""));
  }
  const auto method = message.find("method");
  if (method == message.end() || !method->is_string()) {
    return refuse(id, invalid_request("\"method\" must be a string, such as \"status\""));
  }
  json params = take(message, "params", json::object());
  if (params.is_null() || params.empty()) params = json::object();  // some libraries write "no parameters" like this
  if (!params.is_object()) {
    return refuse(id, invalid_params("\"params\" must be an object: parameters go by name"));
  }
  return Request{std::move(id), message.contains("id"), std::move(method->get_ref<std::string&>()), std::move(params)};
}

}  // namespace

JsonShape shape_of(std::string_view text) {
  JsonShape shape;
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size() && shape.depth <= kMaxNesting && shape.values <= kMaxValues; ++i) {
    const char c = text[i];
    if (in_text && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_text = !in_text;
    } else if (!in_text && (c == '{' || c == '[')) {
      shape.depth = std::max(shape.depth, ++depth);
      ++shape.values;
    } else if (!in_text && (c == '}' || c == ']')) {
      --depth;
    } else if (!in_text && c == ',') {
      ++shape.values;
    }
  }
  shape.closed = depth == 0 && !in_text;
  return shape;
}

ParsedJson parse_json(std::string_view text) {
  // The parser would take a null character for the end.
  if (text.find('\0') != std::string_view::npos) return {json(json::value_t::discarded), {}};
  std::optional<std::string> repeated;
  std::vector<std::set<std::string>> names;  // of the objects that are open
  const auto note = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) names.emplace_back();
    if (event == json::parse_event_t::object_end) names.pop_back();
    if (event == json::parse_event_t::key && !repeated) {
      const auto& name = parsed.get_ref<const std::string&>();
      if (!names.back().insert(name).second) repeated = name;
    }
    return true;
  };
  json value = json::parse(text, note, /*allow_exceptions=*/false);
  return {std::move(value), std::move(repeated)};
}

std::string appears_twice(const std::string& name) {
  return "\"" + printable(name, kMaxQuotedNameBytes) + "\" appears twice in one object: give it once";
}

tl::expected<Request, BadRequest> parse_request(std::string_view line) {
  const JsonShape shape = shape_of(line);
  if (shape.depth > kMaxNesting) {
    return refuse(nullptr, parse_error("nested deeper than " + std::to_string(kMaxNesting) + " levels"));
  }
  if (shape.values > kMaxValues) {
    return refuse(nullptr,
                  parse_error("more than " + std::to_string(kMaxValues) + " values: a request needs only a few"));
  }
  // Does not parse a truncated message: the parser's unused error would quote all of it.
  auto [message, repeated] = shape.closed ? parse_json(line) : ParsedJson{json(json::value_t::discarded), {}};
  if (message.is_discarded()) {
    return refuse(nullptr, parse_error("not JSON, or a number beyond 1e308: send one JSON-RPC 2.0 object per line, in "
                                       "UTF-8"));
  }
  if (message.is_array()) {
    return refuse(nullptr, invalid_request("batches are not supported: send one request per line"));
  }
  if (!message.is_object()) return refuse(nullptr, invalid_request("a request must be a JSON object"));
  json id = message.contains("id") ? message["id"] : json();
  if (!usable_as_id(id)) {
    return refuse(nullptr,
                  invalid_request("\"id\" must be a number of at most 64 bits, null or a string of at most 256 bytes"));
  }
  if (repeated) return refuse(*repeated == "id" ? json() : std::move(id), invalid_request(appears_twice(*repeated)));
  return read_members(message, std::move(id));
}

}  // namespace slsd
