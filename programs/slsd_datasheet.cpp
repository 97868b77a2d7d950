// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include <nlohmann/json.hpp>
#include <slsd/connection.hpp>

#include "clients/usage/usage.hpp"
#include "daemon/rpc/message.hpp"
#include "programs/datasheet/make_datasheet.hpp"

namespace {

constexpr int kDone = 0, kFailed = 1, kNoService = 3;

}  // namespace

// Carries out slsctl datasheet, which starts it with the same command line.
int main(int argc, char** argv) {
  CLI::App app("Carries out slsctl datasheet.", "slsctl");
  slsd::DatasheetRequest request;
  request.socket = slsd::client::default_socket();
  app.add_option("--socket", request.socket, "the service's socket")->type_name("PATH");
  app.add_flag("--json", request.json, "print JSON, one object per line, also for errors");
  app.require_subcommand(1);
  app.fallthrough();
  slsd::add_datasheet_options(*app.add_subcommand("datasheet", slsd::kDatasheetPurpose), request);
  if (const auto ended = slsd::parse_usage(app, argc, argv)) return *ended;
  const auto done = slsd::make_datasheet(request);
  if (done) return kDone;
  if (request.json) {
    const nlohmann::json error{{"error", slsd::rpc_error(done.error()).to_json()}};
    std::cout << error.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
  } else {
    std::cerr << "slsctl: " << slsd::to_string(done.error()) << std::endl;
  }
  const bool none = done.error().code == slsd::ErrorCode::kNotFound && done.error().where == request.socket.string();
  return none ? kNoService : kFailed;
}
