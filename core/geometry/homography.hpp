// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include <Eigen/Core>

namespace slsd {

/// The perspective map of one plane onto another: px or mm on either.
/// @thread reentrant
struct Homography {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< maps homogeneous points

  [[nodiscard]] Eigen::Vector2d map(const Eigen::Vector2d& point) const;
  /// The map's derivative there: one column for x and one for y.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& point) const;
  [[nodiscard]] Homography inverse() const;
};

/// The homography that maps points of one plane to those of another, robustly: points that lie far off count little.
/// Normalised direct linear transformation (Hartley 1997), reweighted.
/// @param from  four or more, not all on a line
/// @param to    as many
/// @return `to` from `from`, last element 1
/// @thread reentrant
[[nodiscard]] Homography fit_robust_homography(std::span<const Eigen::Vector2d> from,
                                               std::span<const Eigen::Vector2d> to);

}  // namespace slsd
