// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include <glog/logging.h>
#include <nlohmann/json.hpp>
#include <slsd/connection.hpp>

#include "clients/usage/usage.hpp"
#include "daemon/rpc/message.hpp"
#include "programs/command_line.hpp"
#include "programs/hand_eye/hand_eye_from_files.hpp"

namespace {

constexpr int kNoService = 3;

}  // namespace

// Carries out slsctl hand-eye, which starts it with the same command line.
int main(int argc, char** argv) {
  CLI::App app("Carries out slsctl hand-eye.", "slsctl");
  slsd::HandEyeRequest request;
  request.socket = slsd::client::default_socket();
  app.add_option("--socket", request.socket, "the service's socket")->type_name("PATH");
  app.add_flag("--json", request.json, "print JSON, one object per line, also for errors");
  app.require_subcommand(1);
  app.fallthrough();
  slsd::add_hand_eye_options(*app.add_subcommand("hand-eye", slsd::kHandEyePurpose), request);
  if (const auto ended = slsd::parse_usage(app, argc, argv)) return *ended;
  FLAGS_minloglevel = google::GLOG_FATAL;  // the result is judged anyway, so Ceres need not warn
  const bool by_socket = request.from_service || !request.pose.empty();
  const auto done = by_socket ? slsd::hand_eye_by_socket(request) : slsd::hand_eye_from_files(request);
  if (done) return slsd::kDone;
  if (request.json) {
    const nlohmann::json error{{"error", slsd::rpc_error(done.error()).to_json()}};
    std::cout << error.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
  } else {
    std::cerr << "slsctl: " << slsd::to_string(done.error()) << std::endl;
  }
  const bool none = done.error().code == slsd::ErrorCode::kNotFound && done.error().where == request.socket.string();
  return none ? kNoService : slsd::kFailed;
}
