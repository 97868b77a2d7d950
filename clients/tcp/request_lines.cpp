// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/tcp/request_lines.hpp"

#include <utility>

#include "rpc/message.hpp"
#include "rpc/param_reader.hpp"

namespace slsd::tcp {
namespace {

using nlohmann::json;

constexpr const char* kTokenFirst =
    R"(the first line must bring the token: {"jsonrpc":"2.0","id":1,"method":"authenticate","params":{"token":"..."}})";

// A request that asks for a memfd, with "inline" in its place; any other line as it is.
std::string inline_request(std::string_view line) {
  std::string same = std::string(line) + '\n';
  // A request without these characters has no transport; escapes may hide them.
  if (line.find("memfd") == std::string_view::npos && line.find('\\') == std::string_view::npos) return same;
  const auto request = parse_request(line);
  if (!request) return same;
  const auto transport = request->params.find("transport");
  if (transport == request->params.end() || *transport != "memfd") return same;
  json params = request->params;
  params["transport"] = "inline";
  json message{{"jsonrpc", "2.0"}, {"method", request->method}, {"params", std::move(params)}};
  if (request->wants_reply) message["id"] = request->id;
  return to_line(message);
}

}  // namespace

tl::expected<Greeting, BadRequest> read_greeting(std::string_view line) {
  const auto refuse = [](json id, RpcError error) {
    return tl::unexpected(BadRequest{std::move(id), std::move(error)});
  };
  if (line.size() > kGreetingBytesMax)
    return refuse(nullptr, invalid_request("the first line has at most " + std::to_string(kGreetingBytesMax) +
                                           " bytes; the connection ends"));
  auto request = parse_request(line);
  if (!request || request->method != "authenticate") {
    const json id = request ? request->id : request.error().id;
    return refuse(id, rpc_error({ErrorCode::kPermissionDenied, kTokenFirst, {}}));
  }
  ParamReader params(request->params);
  std::string token = params.text("token");
  if (const auto error = params.error()) return refuse(request->id, *error);
  return Greeting{std::move(request->id), request->wants_reply, std::move(token)};
}

void RequestLines::append(std::string_view bytes) {
  if (in_long_line_) {
    const std::size_t end = bytes.find('\n');
    const std::size_t size = end == std::string_view::npos ? bytes.size() : end + 1;
    passing_ += bytes.substr(0, size);
    bytes.remove_prefix(size);
    in_long_line_ = end == std::string_view::npos;
  }
  lines_.append(bytes);
}

std::string RequestLines::take() {
  std::string taken = std::exchange(passing_, {});
  while (true) {
    while (const auto line = lines_.next_line()) taken += inline_request(*line);
    if (!lines_.overflown()) return taken;
    const std::string rest = take_held();
    const std::size_t end = rest.find('\n');
    in_long_line_ = end == std::string::npos;
    if (in_long_line_) return taken += rest;
    taken.append(rest, 0, end + 1);
    lines_.append(std::string_view(rest).substr(end + 1));
  }
}

std::string RequestLines::take_rest() {
  const auto line = lines_.rest();
  std::string rest = line ? inline_request(*line) : std::string();
  lines_.clear();
  return rest;
}

std::string RequestLines::take_held() {
  std::string held(lines_.rest().value_or(std::string_view()));
  lines_.clear();
  return held;
}

}  // namespace slsd::tcp
