// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "core/geometry/lens.hpp"

namespace slsd {

/// The ray of a pixel, undistorted, and how it turns as the pixel moves.
struct PixelRay {
  Eigen::Vector2d direction;  ///< normalised: (x/z, y/z) in the device's frame
  Eigen::Matrix2d turn;       ///< change of the direction per (distorted) px: inverse of Lens::distort_jacobian
};

/// @param pixel  distorted, as seen
/// @thread reentrant
[[nodiscard]] inline PixelRay pixel_ray(const Lens& lens, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d direction = lens.undistort(pixel);
  return {direction, lens.distort_jacobian(direction).inverse()};
}

}  // namespace slsd
