// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "drivers/camera/aravis/configure_network.hpp"

namespace slsd {

/// The camera's clock cannot be read.
[[nodiscard]] NetworkWarning device_clock_warning();
/// The chunks of the first frames could not be read.
[[nodiscard]] NetworkWarning chunks_warning();
/// The camera can be made to expose by no means that this host has.
[[nodiscard]] NetworkWarning first_frame_warning();

}  // namespace slsd
