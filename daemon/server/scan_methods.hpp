// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/server/methods.hpp"

namespace slsd {

// The methods of the protocol, as docs/protocol.md says. Each is carried out on the event loop's thread and answers
// through respond.

void run_frame(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);
void run_pattern(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);
void run_preview(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);
void run_settings(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);
void run_scan(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);

}  // namespace slsd
