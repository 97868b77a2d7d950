// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <optional>

#include "core/board/markers/find_markers.hpp"
#include "core/board/measured_points.hpp"
#include "core/image.hpp"

namespace slsd {

/// The corners of a black square on white, each at the intersection of its two edges, which are fitted as straight
/// lines. An edge is the centroid of the slope across it, so symmetrical blur does not move it.
/// @param quad     to about a pixel
/// @param reach_px  free distance on either side of an edge
/// @return  clockwise as in quad, ids 0 to 3; empty if an edge is not visible
/// @thread reentrant
[[nodiscard]] std::optional<std::array<MeasuredPoint, 4>> measure_square(const Image<float>& light, const Quad& quad,
                                                                         double reach_px);

}  // namespace slsd
