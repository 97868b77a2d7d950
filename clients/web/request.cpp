// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/request.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <nlohmann/json.hpp>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"

namespace slsd::web {
namespace {

namespace http = boost::beast::http;
using Fields = http::fields;

// These headers identify the client and the target: a proxy may have read a second one.
constexpr std::string_view kOnce[] = {"Host",          "Content-Length", "Transfer-Encoding", "Origin",
                                      "Authorization", "Sec-Fetch-Site", "X-Slsd-Page",       "Expect"};

Refusal bad(std::string what) {
  return {400, "invalid_request", "the request is ambiguous or malformed: " + std::move(what)};
}

std::string text(boost::beast::string_view view) {
  return {view.data(), view.size()};
}

std::string field(const Fields& fields, std::string_view name) {
  return text(fields[boost::beast::string_view(name.data(), name.size())]);
}

bool has_other_than_token(std::string_view text) {
  return text.empty() || text.find_first_of(" \t,@/\\\"") != std::string_view::npos;
}

std::optional<std::string> without_percents(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      plain += text[i] == '+' ? ' ' : text[i];
      continue;
    }
    std::uint8_t byte = 0;
    if (i + 2 >= text.size()) return std::nullopt;
    const auto [end, error] = std::from_chars(text.data() + i + 1, text.data() + i + 3, byte, 16);
    if (error != std::errc() || end != text.data() + i + 3) return std::nullopt;
    plain += static_cast<char>(byte);
    i += 2;
  }
  return plain;
}

std::optional<Refusal> read_query(std::string_view query, std::map<std::string, std::string>& values) {
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const auto name = without_percents(pair.substr(0, equals));
    const auto value = without_percents(pair.substr(std::min(pair.size(), equals + 1)));
    if (!name || !value) return bad("an escape in its address is not % and two digits");
    if (!values.emplace(*name, *value).second) return bad("its address names a parameter twice");
  }
  return std::nullopt;
}

std::optional<Refusal> read_target(std::string_view target, Request& request) {
  if (target.empty() || target.front() != '/' || target.find('#') != std::string_view::npos)
    return bad("its address is not a path");
  const std::size_t question = std::min(target.find('?'), target.size());
  request.path = target.substr(0, question);
  return read_query(target.substr(std::min(target.size(), question + 1)), request.query);
}

std::optional<Refusal> read_framing(const Fields& fields, Request& request) {
  for (const std::string_view name : kOnce) {
    if (fields.count(boost::beast::string_view(name.data(), name.size())) > 1)
      return bad("the header " + std::string(name) + " appears twice");
  }
  if (fields.count(http::field::transfer_encoding) > 0)
    return bad("Transfer-Encoding is not supported; send the body with a Content-Length");
  if (fields.count(http::field::content_length) > 0) {
    const std::string digits = field(fields, "Content-Length");
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), request.body_bytes);
    if (error != std::errc() || end != digits.data() + digits.size()) return bad("Content-Length is not one number");
  }
  if (request.body_bytes > 0 && (request.method == "GET" || request.method == "HEAD"))
    return bad("a " + request.method + " must not have a body");
  return std::nullopt;
}

std::optional<Refusal> read_fields(const Fields& fields, Request& request) {
  request.host = field(fields, "Host");
  if (has_other_than_token(request.host)) return bad("the header Host is missing, or names no host");
  request.origin = field(fields, "Origin");
  request.authorization = field(fields, "Authorization");
  request.site = field(fields, "Sec-Fetch-Site");
  request.destination = field(fields, "Sec-Fetch-Dest");
  request.page_key = field(fields, "X-Slsd-Page");
  request.by_https = field(fields, "X-Forwarded-Proto") == "https";
  for (auto [each, end] = fields.equal_range(http::field::cookie); each != end; ++each)
    request.cookie += (request.cookie.empty() ? "" : "; ") + text(each->value());
  const std::string expectation = field(fields, "Expect");
  request.expects_continue = boost::beast::iequals(expectation, "100-continue");
  if (!expectation.empty() && !request.expects_continue)
    return Refusal{417, "invalid_request", "only \"Expect: 100-continue\" is supported"};
  return std::nullopt;
}

}  // namespace

HeadEnd find_head_end(std::string_view received) {
  const auto refused = [](Refusal refusal) { return HeadEnd{0, std::move(refusal)}; };
  bool line_begins = true;
  for (std::size_t i = 0; i < received.size(); ++i) {
    const auto byte = static_cast<unsigned char>(received[i]);
    if (i == kHeadBytesMax) return refused({431, "invalid_request", "the request's headers are too long"});
    if (i == kRequestLineBytesMax && received.substr(0, i).find('\n') == std::string_view::npos)
      return refused({414, "invalid_request", "the request's address is too long"});
    if (byte == '\r') {
      if (i + 1 == received.size()) break;
      if (received[i + 1] != '\n') return refused(bad("a line ends without a line feed"));
      ++i;
      if (line_begins && i == 1) return refused(bad("it begins with an empty line"));
      if (line_begins) return {i + 1, std::nullopt};
      line_begins = true;
      continue;
    }
    if (byte == '\n') return refused(bad("a line ends without a carriage return"));
    if ((byte < 0x20 && byte != '\t') || byte == 0x7f) return refused(bad("its head has a control character"));
    if (line_begins && (byte == ' ' || byte == '\t')) return refused(bad("a header is folded"));
    line_begins = false;
  }
  return {};
}

std::optional<Refusal> unknown_parameter(const std::map<std::string, std::string>& query,
                                         const std::vector<std::string>& known) {
  for (const auto& [name, value] : query) {
    if (std::ranges::find(known, name) != known.end()) continue;
    return Refusal{400, "invalid_params",
                   "no such parameter: \"" + printable(name, 64) + "\"" + nearest_hint(name, known)};
  }
  return std::nullopt;
}

std::optional<Refusal> unknown_parameter(const nlohmann::json& body, const std::vector<std::string>& known) {
  std::map<std::string, std::string> names;
  for (const auto& [name, value] : body.items()) names.emplace(name, "");
  return unknown_parameter(names, known);
}

tl::expected<Request, Refusal> read_head(std::string_view head) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(kHeadBytesMax + 1);
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
  boost::system::error_code error;
  const std::size_t read = parser.put(boost::asio::const_buffer(head.data(), head.size()), error);
  if (error || !parser.is_header_done() || read != head.size())
    return tl::unexpected(bad(error ? error.message() : "its head ends early"));
  Request request;
  request.method = text(parser.get().method_string());
  request.keep_alive = parser.get().keep_alive();
  auto refused = read_framing(parser.get(), request);
  if (!refused) refused = read_target(text(parser.get().target()), request);
  if (!refused) refused = read_fields(parser.get(), request);
  if (refused) return tl::unexpected(std::move(*refused));
  return request;
}

}  // namespace slsd::web
