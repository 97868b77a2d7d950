// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// Warnings about exposures that do not suit the projector's refresh or the flicker of lamps. Each camera gets one
/// sentence with the nearest suitable exposures. Empty if all suit or no exposure is configured.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> exposure_warnings(const Configuration& configuration);

}  // namespace slsd
