// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/cloud/cloud.hpp"
#include "core/image.hpp"

namespace slsd {

/// Frames of a camera without the pattern, of the size and depth of its other frames.
struct SceneLight {
  std::optional<GreyView> white;  ///< while the projector showed white
  std::optional<GreyView> dark;   ///< and black: the light of the room alone
  double full = 255;              ///< the level of a saturated pixel
};

/// Gives points the intensity of their places in the white frame, less the dark frame's, 0 to 255 of full. Without a
/// white frame the dark one's is taken from the intensity that they have, which is the symbol's. Where a pixel of the
/// white frame around a point is saturated nothing is known but that it is bright: its intensity is 255.
/// @param points  of that camera alone, within its frame
/// @return        how many of them were saturated
/// @thread reentrant
std::size_t shade_points(std::span<CloudPoint> points, const SceneLight& light);

}  // namespace slsd
