// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace slsd {

/// Tells whether an error of a scan passes by itself, or once a device is plugged in again: then scan again.
/// @param name  the error's `data.name`, as docs/protocol.md lists them
[[nodiscard]] inline bool passes(std::string_view name) {
  constexpr std::array<std::string_view, 8> kPassing{"frame_dropped", "frame_torn", "frame_stale",  "frame_late",
                                                     "frame_skewed",  "timeout",    "disconnected", "busy"};
  return std::ranges::find(kPassing, name) != kPassing.end();
}

}  // namespace slsd
