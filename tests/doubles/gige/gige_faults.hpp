// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <optional>

namespace slsd::test {

/// What a camera on a network does to those who use it. All of it is off at first.
struct GigeFaults {
  int drop_frames = 0;      ///< so many frames from now on are exposed and never sent
  int truncate_frames = 0;  ///< so many are sent by half, and end as if they were whole
  int stale_frames = 0;     ///< so many answer a trigger with what was exposed a second before
  bool silent = false;      ///< answers, and sends no frame
  bool gone = false;        ///< neither answers nor sends
  bool resends = true;      ///< sends packets again when asked
  std::optional<std::chrono::steady_clock::time_point> stalled_until = {};  ///< exposes, and sends only then
};

}  // namespace slsd::test
