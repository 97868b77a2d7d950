// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/marker_family.hpp"
#include "core/image.hpp"

namespace slsd {

/// Corners of a marker or of a candidate, clockwise in the image, to about a pixel.
using Quad = std::array<Eigen::Vector2d, 4>;

struct SeenMarker {
  int id = 0;
  Quad corners;  ///< the first is the marker's own top left

  [[nodiscard]] double side_px() const;  ///< length of its shortest side
};

struct SeenMarkers {
  std::vector<SeenMarker> markers;  ///< ascending ids, without repetition
  std::vector<Quad> unknown;        ///< dark quadrangles that are not markers of the family
};

/// Finds a family's markers. If it finds none or very small ones, it also searches the enlarged image; if none or very
/// large ones, the reduced image.
/// @thread reentrant
[[nodiscard]] SeenMarkers find_markers(const Grey8& image, const MarkerFamily& family);

/// The smallest other family to which most of the quadrangles belong, without any bit error.
/// @return nullptr if there is none, or fewer than three match it
/// @thread reentrant
[[nodiscard]] const MarkerFamily* find_other_family(const Grey8& image, std::span<const Quad> unknown,
                                                    const MarkerFamily& family);

}  // namespace slsd
