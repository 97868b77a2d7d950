// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>

#include "core/result.hpp"

struct _XDisplay;

namespace slsd {

// Xlib ends the process when a request fails or a connection breaks. A service outlives its X server.

/// From now on a request that fails does nothing. GLFW undoes this when it makes a window.
/// @thread thread-safe
void survive_x_errors();

/// From now on the end of this connection sets the flag, and what is asked over it afterwards does nothing.
/// @param lost  outlives the connection
void survive_loss(_XDisplay* display, std::atomic<bool>& lost);

/// That no X server answers, and what to do.
[[nodiscard]] tl::unexpected<Error> no_display();

}  // namespace slsd
