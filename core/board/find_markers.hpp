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

/// Corners of a marker or of what might be one, clockwise in the image, to about a pixel.
using Quad = std::array<Eigen::Vector2d, 4>;

struct SeenMarker {
  int id = 0;
  Quad corners;  ///< first the marker's own top left

  [[nodiscard]] double side_px() const;  ///< length of its shortest side
};

struct SeenMarkers {
  std::vector<SeenMarker> markers;  ///< ascending ids, each id once
  std::vector<Quad> unknown;        ///< dark quadrangles that are none of the family's markers
};

/// Finds a family's markers; where none or very small ones are seen also in the image magnified, where none or very
/// large ones in the image reduced.
/// @thread reentrant
[[nodiscard]] SeenMarkers find_markers(const Grey8& image, const MarkerFamily& family);

/// The smallest other family to which most of the quadrangles belong, without an error in any bit.
/// @return nullptr where there is none, or fewer than three of it
/// @thread reentrant
[[nodiscard]] const MarkerFamily* find_other_family(const Grey8& image, std::span<const Quad> unknown,
                                                    const MarkerFamily& family);

}  // namespace slsd
