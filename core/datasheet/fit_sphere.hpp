// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace slsd {

struct Sphere {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;

  /// Signed distance of a point from the surface, positive outside.
  [[nodiscard]] double off_mm(const Eigen::Vector3d& point) const { return (point - centre_mm).norm() - radius_mm; }
};

/// The sphere of least squared distances from the points: Gauss-Newton on the geometric distance (VDI/VDE 2634 part 2
/// calls it the Gaussian sphere).
/// @param start  near the result
/// @return       empty: fewer than four points, or points on a plane or a line
/// @thread reentrant
[[nodiscard]] std::optional<Sphere> fit_sphere(std::span<const Eigen::Vector3d> points, const Sphere& start);

}  // namespace slsd
