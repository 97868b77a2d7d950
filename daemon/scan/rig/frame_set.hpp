// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// The frames that a scan takes besides those of the pattern.
struct LightFrames {
  bool white = false;  ///< a frame under the projector's white
  bool dark = false;   ///< a frame under the projector's black
};

/// One frame of each camera, all from one exposure. Also has one per camera under white and under black, if requested.
/// @thread thread-bound; may be moved between threads
struct FrameSet {
  std::vector<Frame> frames;  ///< one per camera, in the order of the cameras; at least one
  std::vector<Frame> white;   ///< one per camera, or none
  std::vector<Frame> dark;
  std::chrono::nanoseconds capture_time{};  ///< time from the request to the last frame
  std::chrono::nanoseconds skew{};          ///< time between the first and the last camera's exposure of the pattern

  /// The time when the last byte of the last frame arrived.
  [[nodiscard]] MonotonicTime received() const {
    MonotonicTime last{};
    for (const auto* each : {&frames, &white, &dark}) {
      for (const Frame& frame : *each) last = std::max(last, frame.received());
    }
    return last;
  }
  /// Returns the frames to the drivers.
  void give_back() {
    for (auto* each : {&frames, &white, &dark}) each->clear();
  }
};

}  // namespace slsd
