// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <iostream>

#include "core/utc_text.hpp"
#include "daemon/client/client_commands.hpp"
#include "daemon/client/report.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/file.hpp"

namespace slsd {

int bundle_command(const ClientOptions& options) {
  const auto answered = ask(options, "bundle", nlohmann::json::object());
  if (!answered) return report(options, answered.error());
  std::filesystem::path file = options.output;
  if (file.empty()) {
    std::string time = utc_text(std::chrono::system_clock::now());
    std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
    file = "slsd-" + time + ".tar";
  }
  if (auto written = write_file_atomically(file, answered->reply.bytes); !written)
    return report(options, {kRequestFailed, rpc_error(written.error())});
  nlohmann::json result = answered->reply.message["result"];
  result["file"] = file.string();
  std::cout << (options.json ? to_line(result) : file.string() + "\n") << std::flush;
  return std::cout ? kDone : kRequestFailed;
}

}  // namespace slsd
