// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/ask.hpp"

#include <utility>

namespace slsd {
namespace {

using nlohmann::json;

Failure daemon_failure(const json& error) {
  RpcError told{error.value("code", 0), "error", error.value("message", "the service gave no reason"), {}};
  const auto data = error.find("data");
  if (data != error.end() && data->is_object()) told.name = data->value("name", told.name);
  return {kRequestFailed, std::move(told)};
}

}  // namespace

Failure failure(const Error& error) {
  return {error.code == ErrorCode::kNotFound ? kNoDaemon : kRequestFailed, rpc_error(error)};
}

tl::expected<Answered, Failure> judge(Result<Answered> answered) {
  if (!answered) return tl::unexpected(failure(answered.error()));
  const json& message = answered->reply.message;
  if (message.contains("error") && message["error"].is_object()) {
    return tl::unexpected(daemon_failure(message["error"]));
  }
  if (!message.contains("result") || !message["result"].is_object()) {
    return tl::unexpected(failure({ErrorCode::kMalformed, "not a valid answer of slsd", {}}));
  }
  return std::move(*answered);
}

tl::expected<Answered, Failure> ask(Connection& connection, std::string_view method, const json& params) {
  return judge(connection.call(method, params));
}

tl::expected<Answered, Failure> ask(const ClientOptions& options, std::string_view method, const json& params) {
  auto connection = Connection::open(options.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  return ask(*connection, method, params);
}

}  // namespace slsd
