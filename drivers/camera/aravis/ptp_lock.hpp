// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Whether a device's clock is the network's (IEEE 1588). It takes seconds from opening until it is.
enum class PtpLock {
  kUnknown,  ///< the device does not tell
  kOpen,     ///< it has a clock of its own, or is about to set it
  kLocked    ///< it follows a master's clock, or is the master
};

/// Asks the device.
/// @thread thread-safe for GigE Vision, else thread-bound to the camera
[[nodiscard]] PtpLock read_ptp_lock(ArvCamera* camera);

}  // namespace slsd
