// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

/// Asks all networks of this host which GigE Vision devices there are, also those with an address of another network.
/// @param wait    how long to wait for answers
/// @param enough  true for a device ends the search with it; may be empty
/// @return        each once, with the interface that its answer came through
/// @thread reentrant
[[nodiscard]] std::vector<GigeDevice> discover_gige_devices(std::chrono::milliseconds wait,
                                                            const std::function<bool(const GigeDevice&)>& enough);

}  // namespace slsd
