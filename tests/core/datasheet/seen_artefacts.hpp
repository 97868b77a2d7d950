// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/cloud/read_dense_ply.hpp"
#include "core/datasheet/fit_sphere.hpp"

namespace slsd {

/// Distance along a unit ray from the origin to a sphere; infinite if it passes.
inline double ray_to_sphere(const Eigen::Vector3d& ray, const Sphere& sphere) {
  const double along = ray.dot(sphere.centre_mm);
  const double inside = sphere.radius_mm * sphere.radius_mm - (sphere.centre_mm.squaredNorm() - along * along);
  return inside < 0 ? std::numeric_limits<double>::infinity() : along - std::sqrt(inside);
}

/// Distance along a unit ray to a plane before which the origin is.
inline double ray_to_plane(const Eigen::Vector3d& ray, const Eigen::Vector3d& normal, double offset_mm) {
  const double slope = normal.dot(ray);
  return slope * offset_mm > 0 ? offset_mm / slope : std::numeric_limits<double>::infinity();
}

/// A dense cloud of what a camera of 400 x 300 px with a focal length of 500 px sees, with noise along the rays.
/// @param distance  to the surface along a unit ray; infinite: nothing
inline std::vector<DensePoint> see(const std::function<double(const Eigen::Vector3d&)>& distance, double sigma_mm,
                                   unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_mm);
  std::vector<DensePoint> points;
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 400; ++x) {
      const Eigen::Vector3d ray = Eigen::Vector3d((x - 199.5) / 500, (y - 149.5) / 500, 1).normalized();
      const double to_surface = distance(ray);
      if (!std::isfinite(to_surface)) continue;
      points.push_back({((to_surface + noise(random)) * ray).cast<float>(), static_cast<float>(sigma_mm), 100, 0});
    }
  return points;
}

}  // namespace slsd
