// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/geometry/pixel_ray.hpp"

namespace slsd {

/// pixel_ray() at a fixed price: a coarse grid of undistorted directions, then two steps of Newton's method. The
/// direction agrees with Lens::undistort to 1e-12 for every lens that is invertible().
/// @thread reentrant
class RayTable {
 public:
  explicit RayTable(const Lens& lens);

  /// @param pixel  distorted; outside the image the nearest border's estimate is refined
  [[nodiscard]] PixelRay ray(const Eigen::Vector2d& pixel) const;

 private:
  [[nodiscard]] Eigen::Vector2d estimate(const Eigen::Vector2d& pixel) const;

  Lens lens_;
  int columns_;
  int rows_;
  Eigen::Array2d nodes_per_px_;
  std::vector<Eigen::Vector2d> nodes_;
};

}  // namespace slsd
