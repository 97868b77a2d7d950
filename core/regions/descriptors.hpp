// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// The ten shape descriptors of a binary region, by which Elahi et al. 2020 distinguish the symbols (table 1), and its
/// centroid. A lit pixel is a unit square. m and mu are its moments and central moments, with the square's own 1/12 in
/// mu20 and mu02. All but area, perimeter to area and equivalent diameter are independent of scale. All but orientation
/// and centroid are independent of position and of rotation by 90 degrees.
struct Descriptors {
  double rectangularity = 0;  ///< area / area of the least rectangle around it, at any angle; 0 to 1
  double eccentricity = 0;    ///< sqrt(1 - l2 / l1), l1 >= l2 the eigenvalues of (mu20 mu11; mu11 mu02); 0 to 1
  /// sqrt(l2 / l1): shorter / longer axis of the ellipse with the same second moments; 0 to 1. Not that of the least
  /// rectangle: two squares on the diagonal have equally small rectangles along the cell and along the diagonal.
  double aspect_ratio = 0;
  double convex_to_area = 0;  ///< area of the convex hull of the pixels' corners / area; 1 and more
  /// Perimeter / area, 1/px. The perimeter, holes included, counts the 2x2 neighbourhoods with one, two adjacent, three
  /// and two diagonal lit pixels: n2 + (n1 + n3 + 2 nd) / sqrt(2) (Gray's bit quads).
  double perimeter_to_area = 0;
  double area_px = 0;          ///< the area function: lit pixels, m00
  double orientation_rad = 0;  ///< the longer axis from x towards y: equation (9) with atan2; above -pi/2 to pi/2
  double equivalent_diameter_px = 0;  ///< diameter of a disc of the same area: sqrt(4 area / pi)
  double filled_area_ratio = 0;       ///< area / area with the holes filled; above 0 to 1
  int euler_number = 0;               ///< parts less holes, 8-connected: (n1 - n3 - 2 nd) / 4
  Eigen::Vector2d centroid_px{0, 0};  ///< m10 / m00, m01 / m00 (equation (8)); the mask's first pixel is (0, 0)
};

/// Describes all lit pixels of a mask as one region, connected or not.
/// @param mask  non-zero where lit; the region's bounding box is enough
/// @return      all zeros if nothing is lit
/// @thread reentrant
[[nodiscard]] Descriptors describe_shape(const ImageView<std::uint8_t>& mask);
[[nodiscard]] Descriptors describe_shape(const Grey8& mask);

}  // namespace slsd
