// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include <Eigen/Core>

namespace slsd {

/// The perspective map from one plane to another: px or mm on either.
/// @thread reentrant
struct Homography {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< maps homogeneous points

  [[nodiscard]] Eigen::Vector2d map(const Eigen::Vector2d& point) const;
  /// The map's derivative at a point: one column for x and one for y.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& point) const;
  [[nodiscard]] Homography inverse() const;
};

/// Estimates the homography from points of one plane to points of another, robustly: outliers count little. Normalised
/// direct linear transformation (Hartley 1997), reweighted.
/// @param from  four or more, not all on a line
/// @param to    the same number of points
/// @return `to` from `from`, last element 1
/// @thread reentrant
[[nodiscard]] Homography fit_robust_homography(std::span<const Eigen::Vector2d> from,
                                               std::span<const Eigen::Vector2d> to);

}  // namespace slsd
