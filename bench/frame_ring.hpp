// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd {

inline constexpr std::size_t kRingFrames = 8;

/// Frames of a pattern on planes that differ in distance and tilt, as the paper's rig sees them, 1600x1200. They follow
/// one another and start again: no frame is in the caches of the processor core when it comes round again.
class FrameRing {
 public:
  /// The default symbols at this size on the paper's projector, 2 px apart.
  explicit FrameRing(int symbol_size_px);

  [[nodiscard]] const Pattern& pattern() const { return pattern_; }
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] const std::vector<Grey8>& frames() const { return frames_; }
  [[nodiscard]] const Grey8& next() { return frames_[next_++ % frames_.size()]; }

 private:
  Pattern pattern_;
  Calibration calibration_;
  std::vector<Grey8> frames_;
  std::size_t next_ = 0;
};

}  // namespace slsd
