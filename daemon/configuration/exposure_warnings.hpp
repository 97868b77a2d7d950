// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "daemon/configuration/configuration.hpp"

namespace slsd {

/// What is wrong with the configured exposures for the projector's refresh and the lamps' flicker, a sentence to each
/// camera, with the nearest exposures that suit them. Nothing where all is well or no exposure is configured.
/// @thread reentrant
[[nodiscard]] std::vector<std::string> exposure_warnings(const Configuration& configuration);

}  // namespace slsd
