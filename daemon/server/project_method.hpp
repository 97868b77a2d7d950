// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "daemon/server/methods.hpp"

namespace slsd {

/// Shows a picture until the next scan, as docs/protocol.md says of "project".
void run_project(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);

}  // namespace slsd
