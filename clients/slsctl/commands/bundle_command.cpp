// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <ostream>
#include <string>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/report.hpp"
#include "core/utc_text.hpp"
#include "rpc/message.hpp"

namespace slsd {

namespace {

std::string name_by_time() {
  std::string time = utc_text(std::chrono::system_clock::now());
  std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
  return "slsd-" + time + ".tar";
}

}  // namespace

int bundle_command(const ClientOptions& asked) {
  ClientOptions options = asked;
  if (options.output.empty()) options.output = name_by_time();
  if (auto writable = check_outputs(options); !writable) return report(options, writable.error());
  const auto answered = ask(options, "bundle", nlohmann::json::object());
  if (!answered) return report(options, answered.error());
  if (auto written = write_output(options.output, answered->reply.bytes); !written)
    return report(options, written.error());
  nlohmann::json result = answered->reply.message["result"];
  const std::string file = options.output.string();
  result["file"] = file;
  if (options.json || file != "-") words(options) << (options.json ? to_line(result) : file + "\n");
  return kDone;
}

}  // namespace slsd
