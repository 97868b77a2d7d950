// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/server/methods.hpp"

namespace slsd {

/// What `status` answers: the service, its devices, and what all scans came to.
[[nodiscard]] nlohmann::json status_json(const ServiceState& state);

}  // namespace slsd
