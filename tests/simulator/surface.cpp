// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/simulator/surface.hpp"

#include <cmath>

#include <Eigen/Geometry>

namespace slsd {

Surface plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  return [point, normal](const Ray& ray) -> std::optional<double> {
    const double t = normal.dot(point - ray.origin) / normal.dot(ray.direction);
    return std::isfinite(t) && t > 0 ? std::optional(t) : std::nullopt;
  };
}

Surface cylinder(const Eigen::Vector3d& point, const Eigen::Vector3d& axis, double radius_mm) {
  const Eigen::Vector3d along = axis.normalized();
  return [point, along, radius_mm](const Ray& ray) -> std::optional<double> {
    // Both projected onto the plane across the axis: a line and a circle.
    const Eigen::Vector3d to_origin = ray.origin - point;
    const Eigen::Vector3d o = to_origin - along * along.dot(to_origin);
    const Eigen::Vector3d d = ray.direction - along * along.dot(ray.direction);
    const double a = d.squaredNorm();
    const double b = o.dot(d);
    const double discriminant = b * b - a * (o.squaredNorm() - radius_mm * radius_mm);
    if (discriminant < 0 || a == 0) return std::nullopt;
    const double t = (-b - std::sqrt(discriminant)) / a;
    return t > 0 ? std::optional(t) : std::nullopt;
  };
}

}  // namespace slsd
