// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// The convex hull of the lit pixels as unit squares: the hull of their corners, half a pixel from the centres.
/// Andrew's monotone chain.
/// @param mask  non-zero where lit
/// @return      the corners in order (clockwise in the image), none collinear; empty if nothing is lit
/// @thread reentrant
[[nodiscard]] std::vector<Eigen::Vector2d> convex_hull(const ImageView<std::uint8_t>& mask);

/// The area of a polygon, px^2 (the shoelace formula).
[[nodiscard]] double polygon_area(const std::vector<Eigen::Vector2d>& polygon);

/// The area of the smallest rectangle, at any angle, around a convex polygon, px^2. One of its sides lies on a side of
/// the polygon.
[[nodiscard]] double least_rectangle_area(const std::vector<Eigen::Vector2d>& hull);

}  // namespace slsd
