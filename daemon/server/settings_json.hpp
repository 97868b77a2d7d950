// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// What `settings` answers besides the pattern and the calibration: version, projector, cameras, and the keys that the
/// configuration in force gives.
[[nodiscard]] nlohmann::json settings_json(const Configuration& configuration);

}  // namespace slsd
