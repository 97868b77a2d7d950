// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/exposure/camera_gamma.hpp"
#include "core/exposure/frame_change.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/exposure/noise_between.hpp"
#include "core/exposure/pattern_pitch.hpp"
#include "core/exposure/tile.hpp"

namespace slsd {

/// The light in a camera's frames under the pattern.
struct FrameLight {
  LightLevels levels;
  std::vector<PatternedTile> tiles = {};   ///< those of the first frame that show the pattern
  FrameNoise noise = {};                   ///< of the first frame
  std::optional<FrameChange> change = {};  ///< to the second frame, if there is one
  NoiseBetween between = {};               ///< noise between both frames
  std::optional<CameraGamma> gamma = {};   ///< empty: not measurable
  std::optional<PatternPitch> pitch = {};  ///< of a scan's symbols; empty: not measured
  bool exposure_is_configured = true;      ///< if not, the camera may choose it itself

  /// One standard deviation of a pixel's noise: between the frames if they differ, else within the first.
  [[nodiscard]] double noise_at(double level) const;
};

/// Measures what one frame shows, and, with a second one, what differs between them.
/// @param first, second  taken one after the other with the same setting while the pattern was shown
/// @param full           the level of a saturated pixel
/// @thread reentrant
[[nodiscard]] FrameLight measure_frame_light(const GreyView& first, const std::optional<GreyView>& second, double full);

}  // namespace slsd
