// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>

#include "core/utc_text.hpp"
#include "daemon/configuration/presets.hpp"
#include "daemon/server/methods/answer.hpp"
#include "daemon/server/methods/methods_by_kind.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {
namespace {

using nlohmann::json;

Outcome changed_presets(const ServiceState& state, const std::string& name, Result<json> presets) {
  if (!presets) return tl::unexpected(rpc_error(presets.error()));
  auto written = write_presets(presets_file(state.configuration_file), *presets);
  if (!written) return tl::unexpected(rpc_error(written.error()));
  return Reply{{{"name", name}, {"presets", presets->size()}}};
}

Result<json> without_preset(json presets, const std::string& name) {
  // Any preset can be deleted, also one of another version.
  if (!presets.contains(name))
    if (auto missing = settings_of_preset(presets, name, json::object()); !missing) return missing;
  presets.erase(name);
  return presets;
}

}  // namespace

Result<json> find_preset(const ServiceState& state, const std::string& name) {
  const auto presets = read_presets(presets_file(state.configuration_file));
  if (!presets) return presets;
  return settings_of_preset(*presets, name, state.settings);
}

void run_presets(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string only = reader.text("name");
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  auto presets = read_presets(presets_file(state.configuration_file));
  if (!presets) return respond(tl::unexpected(rpc_error(presets.error())));
  if (!only.empty()) {
    if (auto found = settings_of_preset(*presets, only, state.settings); !found)
      return respond(tl::unexpected(rpc_error(found.error())));
    presets = json{{only, (*presets)[only]}};
  }
  json in_force;
  for (const auto& [name, preset] : presets->items()) {
    const auto settings = settings_of_preset(*presets, name, state.settings);
    if (in_force.is_null() && settings && *settings == state.settings) in_force = name;
  }
  respond(Reply{{{"presets", std::move(*presets)}, {"in_force", std::move(in_force)}}});
}

void run_preset(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string action = reader.choice("action", {"use", "save", "delete"});
  const std::string name = reader.text("name");
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (action == "use") {
    auto settings = find_preset(state, name);
    if (!settings) return respond(tl::unexpected(rpc_error(settings.error())));
    return use_settings(state, std::move(*settings), std::move(respond));
  }
  auto presets = read_presets(presets_file(state.configuration_file));
  if (!presets) return respond(tl::unexpected(rpc_error(presets.error())));
  const std::string now = utc_text(std::chrono::system_clock::now());
  respond(changed_presets(state, name,
                          action == "save" ? with_preset(std::move(*presets), name, state.settings, now)
                                           : without_preset(std::move(*presets), name)));
}

}  // namespace slsd
