// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods/methods.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <spdlog/spdlog.h>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/within_memory.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

bool always(const json&) {
  return true;
}

bool unless_as_shown(const json& params) {
  return params.value("as_shown", json()) != true;
}

constexpr std::array kMethods{
    RpcMethod{"bundle", Role::kAdminister, run_bundle},
    RpcMethod{"calibrate", Role::kAdminister, run_calibrate},
    RpcMethod{"frame", Role::kScan, run_frame, unless_as_shown},
    RpcMethod{"metrics", Role::kObserve, run_metrics},
    RpcMethod{"pattern", Role::kObserve, run_pattern},
    RpcMethod{"preset", Role::kAdminister, run_preset, always},
    RpcMethod{"presets", Role::kObserve, run_presets},
    RpcMethod{"preview", Role::kScan, run_preview, always},
    RpcMethod{"project", Role::kAdminister, run_project, always},
    RpcMethod{"reload", Role::kAdminister, run_reload, always},
    RpcMethod{"scan", Role::kScan, run_scan, always},
    RpcMethod{"set", Role::kAdminister, run_set, always},
    RpcMethod{"settings", Role::kObserve, run_settings},
    RpcMethod{"status", Role::kObserve, run_status},
    RpcMethod{"subscribe", Role::kScan, run_subscribe},
    RpcMethod{"unsubscribe", Role::kObserve, run_unsubscribe},
};

RpcError not_for(Session& session, const RpcMethod& method) {
  const Peer& peer = session.peer();
  const MessageId id(MessageId::kClientRefused);
  if (session.is_first_refusal())
    spdlog::warn("a client (process {}, user {}) asked for {}, which needs the role \"{}\": refused", peer.process,
                 peer.user, method.name, to_string(method.role));
  return rpc_error({ErrorCode::kPermissionDenied,
                    "\"" + std::string(method.name) + "\" needs the role \"" + std::string(to_string(method.role)) +
                        "\", but user " + std::to_string(peer.user) + " has \"" +
                        std::string(to_string(session.role())) + "\": " + session.way_to(method.role),
                    {}});
}

// While somebody holds a calibration board in the light, no other client may change the light.
bool would_disturb(const ServiceState& state, const RpcMethod& method, const json& params, const Session& session) {
  if (!state.calibration || !state.calibration->under_way()) return false;
  if (session.peer().process == state.calibration->process()) return false;
  return method.disturbs != nullptr && method.disturbs(params);
}

}  // namespace

std::span<const RpcMethod> methods() {
  return kMethods;
}

void dispatch(ServiceState& state, const Request& request, Session& session, Respond respond) {
  respond = [&state, answer = std::move(respond)](Outcome outcome) {
    if (!outcome) ++state.requests.failed[outcome.error().name];
    answer(std::move(outcome));
  };
  const auto found = std::ranges::lower_bound(kMethods, request.method, {}, &RpcMethod::name);
  if (found != kMethods.end() && found->name == request.method) {
    if (session.role() < found->role) return respond(tl::unexpected(not_for(session, *found)));
    if (would_disturb(state, *found, request.params, session))
      return respond(tl::unexpected(rpc_error(
          {ErrorCode::kBusy, "a calibration is under way: wait until it ends, or cancel it (calibrate)", {}})));
    const bool is_look = request.method == "calibrate" && request.params.value("action", json("look")) == "look";
    const bool is_own = state.calibration && session.peer().process == state.calibration->process();
    if (found->role == Role::kAdminister && !is_look && !is_own)
      spdlog::info("{}: by user {} (process {})", found->name, session.peer().user, session.peer().process);
    ++state.requests.by_method[found->name];
    return within_memory([&] { found->run(state, request.params, session, respond); },
                         [&] { respond(tl::unexpected(rpc_error(out_of_memory()))); });
  }
  std::vector<std::string> names;
  for (const RpcMethod& method : kMethods) names.emplace_back(method.name);
  respond(tl::unexpected(method_not_found("no such method: \"" + printable(request.method, 64) + "\"" +
                                          nearest_hint(request.method, names))));
}

}  // namespace slsd
