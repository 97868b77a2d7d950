// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace slsd {

/// A plane through points of which some lie off it.
struct PlaneFit {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();   ///< mean of the points on the plane
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit length, away from the origin
  std::vector<std::size_t> on_plane;                  ///< indices of the fitted points
  double rms_mm = 0;                                  ///< root mean square distance of these points from the plane

  /// Signed distance of a point from the plane, along its normal.
  [[nodiscard]] double off_mm(const Eigen::Vector3d& point) const { return normal.dot(point - middle); }
  /// Point at which the ray from the origin in a normalised direction (x/z, y/z) meets the plane.
  [[nodiscard]] Eigen::Vector3d meet(const Eigen::Vector2d& direction) const;
};

/// The plane on which most of the points lie: the least median of squares over draws from a fixed seed, then least
/// squares over points within five robust standard deviations. A bend of all points stays in the residual.
/// @param points  mm, from the viewpoint as origin
/// @return        empty for fewer than three points, or if all lie on a line
/// @thread reentrant
[[nodiscard]] std::optional<PlaneFit> fit_plane(std::span<const Eigen::Vector3d> points);

}  // namespace slsd
