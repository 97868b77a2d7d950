// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/LU>

#include "core/geometry/lens.hpp"

namespace slsd {

/// The undistorted ray of a pixel, and its change as the pixel moves.
struct PixelRay {
  Eigen::Vector2d direction;  ///< normalised: (x/z, y/z) in the device's frame
  Eigen::Matrix2d turn;       ///< change of the direction per (distorted) px: inverse of Lens::distort_jacobian
};

/// Rays of up to kAtOnce pixels, one column for each component, to compute with several at once.
struct PixelRays {
  static constexpr std::size_t kAtOnce = 64;
  using Column = std::array<double, kAtOnce>;
  Column u, v;            ///< pixels
  Column x, y;            ///< directions
  Column xx, xy, yx, yy;  ///< derivatives of the directions

  [[nodiscard]] PixelRay at(std::size_t i) const {
    Eigen::Matrix2d turn;
    turn << xx[i], xy[i], yx[i], yy[i];
    return {{x[i], y[i]}, turn};
  }
  void set(std::size_t i, const PixelRay& ray) {
    x[i] = ray.direction.x(), y[i] = ray.direction.y();
    xx[i] = ray.turn(0, 0), xy[i] = ray.turn(0, 1), yx[i] = ray.turn(1, 0), yy[i] = ray.turn(1, 1);
  }
};

/// @param pixel  distorted, as observed
/// @thread reentrant
[[nodiscard]] inline PixelRay pixel_ray(const Lens& lens, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d direction = lens.undistort(pixel);
  return {direction, lens.distort_jacobian(direction).inverse()};
}

}  // namespace slsd
