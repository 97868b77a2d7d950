// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

#include "daemon/configuration/access.hpp"
#include "daemon/server/methods/methods_by_kind.hpp"
#include "rpc/request.hpp"

namespace slsd {

/// One method of the socket's protocol.
struct RpcMethod {
  std::string_view name;
  Role role;  ///< the role that a client needs
  RunMethod* run;
  /// Tells whether a request with these parameters changes the light or a scan's outcome. Null: no request does.
  bool (*disturbs)(const nlohmann::json& params) = nullptr;
};

/// All methods, by name.
[[nodiscard]] std::span<const RpcMethod> methods();

/// Handles the end of slsd-calibrate: puts its calibration into force as `set` does, and resumes scans.
void calibrated(ServiceState& state, bool made);

/// Carries out a request. @thread thread-bound to the event loop's
void dispatch(ServiceState& state, const Request& request, Session& session, Respond respond);

}  // namespace slsd
