// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <unistd.h>

#include <chrono>
#include <optional>

#include <asio/post.hpp>

#include "core/base64.hpp"
#include "daemon/server/methods/answer.hpp"
#include "daemon/server/methods/methods_by_kind.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {
namespace {

using nlohmann::json;

// Limits a user's pictures per second and at once, because each is decoded and changes the light. No camera needs more.
// Root and the service's own user, which runs slsd-calibrate, are exempt.
constexpr double kPicturesPerSecond = 30.0;

std::optional<RpcError> refused_picture(ServiceState& state, const Session& session) {
  const auto user = session.peer().user;
  if (user == 0 || user == ::geteuid()) return std::nullopt;
  const auto now = std::chrono::steady_clock::now();
  for (auto& [_, allowance] : state.pictures) {
    allowance.left += std::chrono::duration<double>(now - allowance.since).count() * kPicturesPerSecond;
    allowance.since = now;
  }
  std::erase_if(state.pictures, [](const auto& entry) { return entry.second.left >= kPicturesPerSecond; });
  double& left = state.pictures.try_emplace(user, PictureAllowance{kPicturesPerSecond, now}).first->second.left;
  if (left >= 1.0) return left -= 1.0, std::nullopt;
  return rpc_error({ErrorCode::kBusy,
                    "user " + std::to_string(user) + " has shown " +
                        std::to_string(static_cast<int>(kPicturesPerSecond)) +
                        " pictures within a second, the most for one user: try again later",
                    {}});
}

}  // namespace

void run_pattern(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  (void)reader.choice("format", {"png"});
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.pattern(carry<std::string>(state, std::move(respond), [](const std::string& png) {
    return bytes_reply(png, {{"format", "png"}});
  }));
}

void run_project(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const std::string name = reader.choice("picture", {"pattern", "idle", "black", "white", "focus", "grid", "image"});
  const auto png_bytes_max = static_cast<std::size_t>(state.configuration.server.request_bytes_max);
  std::optional<std::string> png = from_base64(reader.text("png", png_bytes_max));
  const int timeout_ms = read_timeout(reader, state);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (!png || (name == "image") == png->empty()) {
    return respond(tl::unexpected(
        invalid_params("\"png\" must be an image in base64, and goes only with \"picture\": \"image\"")));
  }
  if (auto refused = refused_picture(state, session)) return respond(tl::unexpected(*refused));
  state.scanner.project({*picture_named(name), std::move(*png), deadline_in(timeout_ms), session.gone()},
                        [&events = state.events, respond = std::move(respond), name](const Result<>& shown) {
                          auto outcome = std::make_shared<Outcome>(Reply{{{"picture", name}}});
                          if (!shown) *outcome = tl::unexpected(rpc_error(shown.error()));
                          asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
                        });
}

}  // namespace slsd
