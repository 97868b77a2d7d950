// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

#include <nlohmann/json.hpp>

#include "daemon/configuration/configuration.hpp"
#include "daemon/server/service_state.hpp"

namespace slsd {

/// The answer to `settings` without the pattern and the calibration: version, projector, cameras, and the configuration
/// keys in force.
[[nodiscard]] nlohmann::json settings_json(const Configuration& configuration);

/// The answer to `status`: the service, its devices, and the totals of all scans.
[[nodiscard]] nlohmann::json status_json(const ServiceState& state);

/// Tells whether all devices are open, and there is a calibration.
[[nodiscard]] bool is_ready(const ServiceState& state);

/// Memory of this process.
[[nodiscard]] std::uint64_t resident_bytes();

}  // namespace slsd
