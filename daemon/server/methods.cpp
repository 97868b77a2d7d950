// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "core/nearest_name.hpp"
#include "daemon/rpc/param_reader.hpp"
#include "daemon/server/project_method.hpp"
#include "daemon/server/scan_methods.hpp"
#include "daemon/server/status_json.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr double kRateMinHz = 0.001;
constexpr double kRateMaxHz = 1000.0;

void run_status(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  respond(Reply{status_json(state)});
}

void run_subscribe(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const CloudFormat format = cloud_format(reader.choice("format", {"ply", "pcd"}));
  const std::optional<double> rate_hz = reader.number("rate_hz", kRateMinHz, kRateMaxHz);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  json result{{"format", to_string(format)}};
  result["rate_hz"] = rate_hz ? json(*rate_hz) : json();
  respond(Reply{std::move(result)});
  session.subscribe(Subscription(format, rate_hz));
  state.server->update_demand();
}

void run_unsubscribe(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  session.unsubscribe();
  state.server->update_demand();
  respond(Reply{json::object()});
}

void run_reload(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.reload(std::move(respond));
}

constexpr std::array kMethods{
    RpcMethod{"frame", run_frame},         RpcMethod{"pattern", run_pattern},
    RpcMethod{"preview", run_preview},     RpcMethod{"project", run_project},
    RpcMethod{"reload", run_reload},       RpcMethod{"scan", run_scan},
    RpcMethod{"settings", run_settings},   RpcMethod{"status", run_status},
    RpcMethod{"subscribe", run_subscribe}, RpcMethod{"unsubscribe", run_unsubscribe},
};

}  // namespace

std::span<const RpcMethod> methods() {
  return kMethods;
}

void dispatch(ServiceState& state, const Request& request, Session& session, Respond respond) {
  const auto found = std::ranges::lower_bound(kMethods, request.method, {}, &RpcMethod::name);
  if (found != kMethods.end() && found->name == request.method) {
    return found->run(state, request.params, session, std::move(respond));
  }
  std::vector<std::string> names;
  for (const RpcMethod& method : kMethods) names.emplace_back(method.name);
  respond(tl::unexpected(method_not_found("no such method: \"" + request.method.substr(0, 64) + "\"" +
                                          nearest_hint(request.method, names))));
}

}  // namespace slsd
