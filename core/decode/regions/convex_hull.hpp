// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// The convex hull of the lit pixels taken as unit squares: of their corners, which lie half a pixel around the
/// centres. Andrew's monotone chain.
/// @param mask  non-zero where lit
/// @return      the corners in order (clockwise as the picture shows them), none collinear; empty where nothing is lit
/// @thread reentrant
[[nodiscard]] std::vector<Eigen::Vector2d> convex_hull(const ImageView<std::uint8_t>& mask);

/// The area of a polygon, px^2 (the shoelace formula).
[[nodiscard]] double polygon_area(const std::vector<Eigen::Vector2d>& polygon);

/// The area of the rectangle of least area, at any angle, around a convex polygon, px^2: one of its sides lies on one
/// of the polygon's.
[[nodiscard]] double least_rectangle_area(const std::vector<Eigen::Vector2d>& hull);

}  // namespace slsd
