// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>
#include <string>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/report.hpp"
#include "rpc/message.hpp"

namespace slsd {

int metrics_command(const ClientOptions& options) {
  if (auto writable = check_outputs(options); !writable) return report(options, writable.error());
  const bool printed = options.output.empty() || options.output == "-";
  const std::string format = !options.metrics_format.empty() ? options.metrics_format
                             : printed                       ? "openmetrics"
                                                             : "prometheus";
  const auto answered = ask(options, "metrics", {{"format", format}});
  if (!answered) return report(options, answered.error());
  const std::string_view text = answered->reply.bytes;
  if (options.output.empty()) {
    std::cout << (options.json ? to_line({{"format", format}, {"text", text}}) : text) << std::flush;
    return std::cout ? kDone : kRequestFailed;
  }
  if (auto written = write_output(options.output, text); !written) return report(options, written.error());
  if (options.json) words(options) << to_line(answered->reply.message["result"]);
  return kDone;
}

}  // namespace slsd
