// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>

#include <Eigen/Core>

namespace slsd {

struct Ray {
  Eigen::Vector3d origin;     ///< mm, camera frame
  Eigen::Vector3d direction;  ///< any length
};

/// What a ray meets first: the factor of its direction, greater than zero; nothing where it misses.
/// @thread reentrant
using Surface = std::function<std::optional<double>(const Ray&)>;

/// @param point   a point of the plane, mm, camera frame
/// @param normal  its normal, any length and sign
[[nodiscard]] Surface plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

/// An endless cylinder.
/// @param point   a point of the axis, mm, camera frame
/// @param axis    its direction, any length
[[nodiscard]] Surface cylinder(const Eigen::Vector3d& point, const Eigen::Vector3d& axis, double radius_mm);

}  // namespace slsd
