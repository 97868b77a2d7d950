// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/settings_over.hpp"
#include "daemon/server/methods/answer.hpp"
#include "daemon/server/methods/methods_by_kind.hpp"
#include "daemon/server/methods/metrics.hpp"
#include "daemon/server/methods/scan_json.hpp"
#include "daemon/server/methods/status_json.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kBundleNotesBytes = 1 << 20;

}  // namespace

void run_status(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  json status = status_json(state);
  status["role"] = to_string(session.role());
  respond(Reply{std::move(status)});
}

void run_metrics(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string format = reader.choice("format", {"openmetrics", "prometheus"});
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const bool older = format == "prometheus";
  respond(bytes_reply(metrics_text(state, older ? MetricsFormat::kPrometheus : MetricsFormat::kOpenMetrics),
                      {{"format", format}}));
}

void run_bundle(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (auto refused = session.reserve(state.scanner.black_box().bytes() + kBundleNotesBytes))
    return respond(tl::unexpected(*refused));
  state.bundle(carry<std::string>(state, std::move(respond), [](const std::string& bundle) {
    return bytes_reply(bundle, {{"format", "tar"}});
  }));
}

void run_settings(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const SharedSetup setup = state.scanner.setup();
  const ScanFiles files = setup->files();
  Reply reply{settings_json(state.configuration)};
  if (setup->hand_eye)
    reply.result["hand_eye"] = {{"mounted", setup->hand_eye->mounted == Mounted::kArm ? "arm" : "cell"}};
  reply.result["pattern"] = files.pattern;
  reply.result["calibration"] = files.calibration;
  if (!files.hand_eye.empty()) reply.result["hand_eye_file"] = files.hand_eye;
  reply.result["set"] = state.settings;
  reply.result["file"] = state.configuration_file.string();
  respond(std::move(reply));
}

void run_reload(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.reload(state.settings, std::move(respond));
}

void use_settings(ServiceState& state, json settings, Respond respond) {
  state.reload(std::move(settings), [&state, respond = std::move(respond)](Outcome outcome) {
    if (outcome) {
      outcome->result["set"] = state.settings;
      if (!outcome->result.contains("not_kept")) outcome->result["not_kept"] = nullptr;
    }
    respond(std::move(outcome));
  });
}

void run_set(ServiceState& state, const json& params, Session&, Respond respond) {
  auto settings = merge_settings(state.settings, params);
  if (!settings) return respond(tl::unexpected(invalid_params(settings.error().message)));
  use_settings(state, std::move(*settings), std::move(respond));
}

}  // namespace slsd
