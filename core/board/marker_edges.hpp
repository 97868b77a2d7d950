// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <optional>

#include "core/board/find_markers.hpp"
#include "core/board/measured_points.hpp"
#include "core/image.hpp"

namespace slsd {

/// The corners of a black square on white, each where its two edges, fitted as straight lines, meet. An edge is the
/// centroid of the slope across it: symmetrical blur does not move it.
/// @param quad     to about a pixel
/// @param reach_px  how far to either side of an edge nothing else is seen
/// @return  clockwise as in quad, ids 0 to 3; nothing where an edge is not seen
/// @thread reentrant
[[nodiscard]] std::optional<std::array<MeasuredPoint, 4>> measure_square(const Image<float>& light, const Quad& quad,
                                                                         double reach_px);

}  // namespace slsd
