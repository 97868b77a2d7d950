// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "clients/model/places/track.hpp"

namespace slsd::model {

/// Result of an adjustment of all places.
struct Adjustment {
  std::size_t links = 0;  ///< pairs of frames that see the same surface
  bool closed = false;    ///< a frame from the end meets one from the beginning
  double drift_mm = 0;    ///< before: how far apart the first and the last frames put the surface that both see
  double seam_mm = 0;     ///< the same after it
  double over_sigma = 0;  ///< usual distance between the surfaces of linked frames over its sigma
  std::vector<std::optional<double>> fit;  ///< the same for each frame; nothing if no other sees its surface
};

/// Tells whether a later frame looks at the object from the side of an early one again.
/// @param early, late  indices of frames @thread reentrant
[[nodiscard]] bool came_round(std::span<const ModelFrame> frames, std::size_t early, std::size_t late);

/// Moves all frames so that their surfaces meet: one adjustment over all places, of the distances between the surfaces
/// of each pair of frames that look at the object from similar sides, weighted by 1/sigma^2 of both. The first frame
/// stays.
/// @thread reentrant
Adjustment adjust(std::span<ModelFrame> frames);

}  // namespace slsd::model
