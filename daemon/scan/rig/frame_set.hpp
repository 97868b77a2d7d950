// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/image.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The frames that a scan takes besides those of the pattern.
struct LightFrames {
  bool white = false;   ///< a frame under the projector's white
  bool dark = false;    ///< a frame under the projector's black
  bool colour = false;  ///< these frames of the texture cameras, too
};

/// The second, longer exposures of one picture, by camera. None for a camera that takes only one.
using LongerFrames = std::vector<std::optional<Frame>>;

/// One frame of each camera, all from one exposure. Also has one per camera under white and under black, if requested.
/// @thread thread-bound; may be moved between threads
struct FrameSet {
  std::vector<Frame> frames;  ///< one per camera that measures, in the order of the cameras; at least one
  std::vector<Frame> white;   ///< one per camera, or none; those of texture cameras come last, if they are wanted
  std::vector<Frame> dark;
  LongerFrames longer, longer_white, longer_dark;  ///< as the three above; empty if no camera takes two exposures
  std::vector<double> exposure_ratios;             ///< longer to shorter, by camera; 1 or none with one exposure
  std::vector<Grey16> merged;                      ///< memory of the frames that merge_frames() made

  /// Tells whether merge_frames() made the camera's frames.
  [[nodiscard]] bool is_merged(std::size_t camera) const {
    return !merged.empty() && camera < exposure_ratios.size() && exposure_ratios[camera] > 1;
  }
  std::chrono::nanoseconds capture_time{};  ///< time from the request to the last frame
  std::chrono::nanoseconds skew{};          ///< time between the first and the last camera's exposure of the pattern

  /// The time when the last byte of the last frame arrived.
  [[nodiscard]] MonotonicTime received() const {
    MonotonicTime last{};
    for (const auto* each : {&frames, &white, &dark}) {
      for (const Frame& frame : *each) last = std::max(last, frame.received());
    }
    for (const auto* each : {&longer, &longer_white, &longer_dark}) {
      for (const auto& frame : *each) last = frame ? std::max(last, frame->received()) : last;
    }
    return last;
  }
  /// Returns the frames to the drivers.
  void give_back() {
    for (auto* each : {&frames, &white, &dark}) each->clear();
    for (auto* each : {&longer, &longer_white, &longer_dark}) each->clear();
    merged.clear();
  }
};

}  // namespace slsd
