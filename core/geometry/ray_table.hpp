// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/pixel_ray.hpp"

namespace slsd {

/// pixel_ray() at constant cost: a coarse grid of undistorted directions, then one step of Newton's method, or two if
/// the lens distorts strongly. For every lens that is invertible(), the direction agrees with Lens::undistort to 1e-9
/// (some millionths of a pixel), and the turn to 1e-4 of itself.
/// @thread reentrant
class RayTable {
 public:
  explicit RayTable(const Lens& lens);

  /// @param pixel  distorted; outside the image, the border cells are extrapolated
  [[nodiscard]] PixelRay ray(const Eigen::Vector2d& pixel) const;
  /// The same for many: reads `u` and `v` of the first `count`, and writes the rest.
  void look_up(PixelRays& rays, std::size_t count) const;

 private:
  [[nodiscard]] Eigen::Vector2d estimate(double u, double v) const;
  [[nodiscard]] double error_between_nodes() const;

  Lens lens_;
  int columns_;
  int rows_;
  Eigen::Array2d nodes_per_px_;
  std::vector<Eigen::Vector2d> nodes_;
  bool refines_ = false;  // whether to take a second step
};

}  // namespace slsd
