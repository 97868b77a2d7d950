// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/datasheet/fit_sphere.hpp"

namespace slsd {

/// A sphere that was seen, and its points.
struct SeenSphere {
  Sphere sphere;                    ///< fitted to the points
  std::vector<std::size_t> points;  ///< indices: within the cap, and near the surface
};

/// Half of the cone around the direction towards the scanner in which points of a sphere are used. Further out the
/// surface is seen at a grazing angle.
inline constexpr double kCapDegrees = 60;

/// Finds spheres of a known diameter among other surfaces, the one with the most points first: draws of three points
/// and the radius, from a fixed seed, then least squares.
/// @param points  mm, in a frame whose origin is the scanner
/// @param most    spheres to find at most
/// @return        spheres whose points cover the cap: no cylinder, no part of a plane
/// @thread reentrant
[[nodiscard]] std::vector<SeenSphere> find_spheres(std::span<const Eigen::Vector3d> points, double diameter_mm,
                                                   std::size_t most);

}  // namespace slsd
