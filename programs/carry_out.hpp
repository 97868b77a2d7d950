// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <iostream>
#include <string>

#include <nlohmann/json.hpp>
#include <slsd/connection.hpp>

#include "clients/usage/usage.hpp"
#include "core/result.hpp"
#include "rpc/message.hpp"

namespace slsd {

/// Carries out a command of slsctl in a program of its own, which slsctl starts with the same command line.
/// @tparam Request     what its options give, among it `socket` and `json`
/// @param add_options  of the command
/// @return             the exit status: 0, 1 if it failed, 2 for wrong usage, 3 if no service answers
template <class Request>
int carry_out(int argc, char** argv, const std::string& command, const char* purpose,
              void (*add_options)(CLI::App&, Request&), Result<> (*run)(const Request&)) {
  CLI::App app("Carries out slsctl " + command + ".", "slsctl");
  Request request;
  request.socket = client::default_socket();
  app.add_option("--socket", request.socket, "the service's socket")->type_name("PATH");
  app.add_flag("--json", request.json, "print JSON, one object per line, also for errors");
  app.require_subcommand(1);
  app.fallthrough();
  add_options(*app.add_subcommand(command, purpose), request);
  if (const auto ended = parse_usage(app, argc, argv)) return *ended;
  const Result<> done = run(request);
  if (done) return 0;
  if (request.json) {
    const nlohmann::json error{{"error", rpc_error(done.error()).to_json()}};
    std::cout << error.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
  } else {
    std::cerr << "slsctl: " << to_string(done.error()) << std::endl;
  }
  const bool no_service = done.error().code == ErrorCode::kNotFound && done.error().where == request.socket.string();
  return no_service ? 3 : 1;
}

}  // namespace slsd
