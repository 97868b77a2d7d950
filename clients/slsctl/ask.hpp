// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/client_options.hpp"
#include "core/result.hpp"
#include "rpc/message.hpp"

namespace slsd {

/// The cause of a command's failure, from the daemon or from this side, with the exit status that it implies.
struct Failure {
  int exit_status;
  RpcError error;
};

/// A failure on this side. @return kNoDaemon if no daemon answers, else kRequestFailed
[[nodiscard]] Failure failure(const Error& error);

/// A call's outcome; a JSON-RPC error is a failure.
[[nodiscard]] tl::expected<Answered, Failure> judge(Result<Answered> answered);

/// Makes one call; a JSON-RPC error is a failure.
[[nodiscard]] tl::expected<Answered, Failure> ask(Connection& connection, std::string_view method,
                                                  const nlohmann::json& params);

/// Makes one call on a new connection.
[[nodiscard]] tl::expected<Answered, Failure> ask(const ClientOptions& options, std::string_view method,
                                                  const nlohmann::json& params);

}  // namespace slsd
