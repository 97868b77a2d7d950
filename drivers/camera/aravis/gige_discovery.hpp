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

/// Asks the device at the address who it is (GVCP discovery). Aravis itself would wait for seconds for one that is not
/// there, and may ask through the wrong interface.
/// @param interface  IPv4 address of this host to ask from; empty: the one that the route goes through
/// @errors kNotFound: nothing answers; kInvalidArgument: no address, or the interface is not one of this host's
/// @thread reentrant
[[nodiscard]] Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface,
                                                   std::chrono::milliseconds timeout);

/// The application that controls the device: "10.0.0.5:4711", or "another application" if the device does not tell.
/// Empty if none does.
/// @return nothing if it does not answer
/// @thread reentrant
[[nodiscard]] std::optional<std::string> gige_controller(const GigeDevice& device, std::chrono::milliseconds timeout);

/// Sends the device an action command. One that is lost is noticed by the frame that does not come.
/// @thread reentrant
void send_gige_action(const std::string& address, const std::string& interface, const ActionKeys& keys,
                      std::optional<std::uint64_t> ticks);

/// Asks all networks of this host which GigE Vision devices there are, also those with an address of another network.
/// @param wait    how long to wait for answers
/// @param enough  true for a device ends the search with it; may be empty
/// @return        each once, with the interface that its answer came through
/// @thread reentrant
[[nodiscard]] std::vector<GigeDevice> discover_gige_devices(std::chrono::milliseconds wait,
                                                            const std::function<bool(const GigeDevice&)>& enough);

}  // namespace slsd
