// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/client/project_command.hpp"

#include <iostream>
#include <utility>

#include "daemon/client/report.hpp"
#include "daemon/rpc/base64.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxFileBytes = 64 << 20;

}  // namespace

int project_command(const ClientOptions& options) {
  nlohmann::json params{{"picture", options.picture.string()}};
  if (options.picture.extension() == ".png") {
    const auto image = read_file(options.picture, kMaxFileBytes);
    if (!image) return report(options, Failure{kRequestFailed, rpc_error(image.error())});
    params = {{"picture", "image"}, {"png", to_base64(*image)}};
  }
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(options, "project", std::move(params));
  if (!answered) return report(options, answered.error());
  if (options.json) std::cout << to_line(answered->reply.message["result"]);
  return kDone;
}

}  // namespace slsd
