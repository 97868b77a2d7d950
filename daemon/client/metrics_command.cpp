// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>
#include <string>

#include "daemon/client/client_commands.hpp"
#include "daemon/client/report.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/file.hpp"

namespace slsd {

int metrics_command(const ClientOptions& options) {
  const std::string format = !options.format.empty()  ? options.format
                             : options.output.empty() ? "openmetrics"
                                                      : "prometheus";
  const auto answered = ask(options, "metrics", {{"format", format}});
  if (!answered) return report(options, answered.error());
  const std::string_view text = answered->reply.bytes;
  if (!options.output.empty()) {
    if (auto written = write_file_atomically(options.output, text); !written)
      return report(options, {kRequestFailed, rpc_error(written.error())});
    if (options.json) std::cout << to_line(answered->reply.message["result"]);
    return kDone;
  }
  std::cout << (options.json ? to_line({{"format", format}, {"text", text}}) : text) << std::flush;
  return std::cout ? kDone : kRequestFailed;
}

}  // namespace slsd
