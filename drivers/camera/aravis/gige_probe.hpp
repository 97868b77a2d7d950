// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <string>

#include "core/result.hpp"

namespace slsd {

/// A GigE Vision device that answered, and through which of this host's interfaces.
struct GigeDevice {
  std::string address;    ///< IPv4
  std::string interface;  ///< IPv4 address of this host
  std::string vendor;
  std::string serial;
};

/// Asks the device at the address who it is (GVCP discovery). Aravis itself would wait for seconds for one that is not
/// there, and may ask through the wrong interface.
/// @param interface  IPv4 address of this host to ask from; empty: the one that the route goes through
/// @errors kNotFound: nothing answers; kInvalidArgument: no address, or the interface is not one of this host's
/// @thread reentrant
[[nodiscard]] Result<GigeDevice> probe_gige_device(const std::string& address, const std::string& interface,
                                                   std::chrono::milliseconds timeout);

}  // namespace slsd
