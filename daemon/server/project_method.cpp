// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/project_method.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include <asio/post.hpp>

#include "daemon/rpc/base64.hpp"
#include "daemon/rpc/param_reader.hpp"

namespace slsd {
namespace {

ProjectedPicture picture_named(const std::string& name) {
  const auto found = std::ranges::find(kProjectedPictures, name);
  return static_cast<ProjectedPicture>(found - kProjectedPictures.begin());
}

}  // namespace

void run_project(ServiceState& state, const nlohmann::json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string name = reader.choice("picture", {"pattern", "idle", "black", "white", "focus", "grid", "image"});
  std::optional<std::string> png = from_base64(reader.text("png"));
  const int timeout_ms = reader.integer("timeout_ms", state.configuration.scan.timeout_ms, 1, kMaxTimeoutMs);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (!png || (name == "image") == png->empty()) {
    return respond(tl::unexpected(invalid_params("\"png\" must be an image as base64, and only with \"image\"")));
  }
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
  state.scanner.project({picture_named(name), std::move(*png), deadline},
                        [&events = state.events, respond = std::move(respond), name](const Result<>& shown) {
                          auto outcome = std::make_shared<Outcome>(Reply{{{"picture", name}}});
                          if (!shown) *outcome = tl::unexpected(rpc_error(shown.error()));
                          asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
                        });
}

}  // namespace slsd
