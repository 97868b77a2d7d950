// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/server/reply.hpp"
#include "daemon/server/service_state.hpp"
#include "daemon/server/session.hpp"

namespace slsd {

/// A method's function. Reads the parameters, and responds once.
using RunMethod = void(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);

/// Methods for frames and clouds: scan_methods.cpp.
RunMethod run_scan, run_preview, run_frame, run_subscribe, run_unsubscribe;
/// Methods for the projector's picture: light_methods.cpp.
RunMethod run_pattern, run_project;
/// Methods for the service's state and settings: state_methods.cpp.
RunMethod run_status, run_metrics, run_bundle, run_settings, run_set, run_reload;
/// Methods for presets: preset_methods.cpp.
RunMethod run_preset, run_presets;
/// The method that calibrates: calibrate_methods.cpp.
RunMethod run_calibrate;

/// Puts settings into force; the reply has all that are set.
void use_settings(ServiceState& state, nlohmann::json settings, Respond respond);
/// The settings to put into force for a preset. @errors of read_presets() and settings_of_preset()
[[nodiscard]] Result<nlohmann::json> find_preset(const ServiceState& state, const std::string& name);

}  // namespace slsd
