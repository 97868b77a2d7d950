// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

/// Asks the device at the address for its identity (GVCP discovery). Aravis would wait for seconds for a missing
/// device, and may ask through the wrong interface.
/// @param interface  IPv4 address of this host to ask from; empty: the route's
/// @errors kNotFound: nothing answers; kInvalidArgument: not an address, or the interface is not one of this host's
/// @thread reentrant
[[nodiscard]] Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface,
                                                   std::chrono::milliseconds timeout);

/// The application that controls the device: "10.0.0.5:4711", or "another application" if the device does not tell.
/// Empty if none does.
/// @return nothing if the device does not answer
/// @thread reentrant
[[nodiscard]] std::optional<std::string> gige_controller(const GigeDevice& device, std::chrono::milliseconds timeout);

/// Sends an action command to the device. If the command is lost, the frame will be missing.
/// @thread reentrant
void send_gige_action(const std::string& address, const std::string& interface, const ActionKeys& keys,
                      std::optional<std::uint64_t> ticks);

/// Finds the GigE Vision devices on all networks of this host, including those with an address of another network.
/// @param wait    the time to wait for answers
/// @param enough  returns true for a device that ends the search; may be empty
/// @return        each device once, with the interface that received its answer
/// @thread reentrant
[[nodiscard]] std::vector<GigeDevice> discover_gige_devices(std::chrono::milliseconds wait,
                                                            const std::function<bool(const GigeDevice&)>& enough);

}  // namespace slsd
