// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>

#include <Eigen/Core>

namespace slsd {

/// A pinhole with OpenCV's distortion k1 k2 p1 p2 k3 (Elahi et al. 2020, equations (24) to (28)). A projector is an
/// inverse camera, with the same model.
/// @thread reentrant
struct Lens {
  int width_px = 0;
  int height_px = 0;
  double fx = 0, fy = 0;  ///< px
  double cx = 0, cy = 0;  ///< px, the first pixel's centre at (0, 0)
  std::array<double, 5> distortion{};

  /// The pixel of a normalised, undistorted direction, and its derivatives: pixels per unit of the direction.
  /// @tparam Number  double, or a vector of them
  template <class Number>
  struct View {
    Number u, v, u_x, u_y, v_x, v_y;
  };
  template <class Number>
  __attribute__((always_inline)) void view(const Number& x, const Number& y, View<Number>& to) const {
    const auto& [k1, k2, p1, p2, k3] = distortion;
    const Number r2 = x * x + y * y;
    const Number radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const Number slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));
    const Number cross = x * y * slope + 2 * p1 * x + 2 * p2 * y;
    to.u = fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx;
    to.v = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy;
    to.u_x = fx * (radial + x * x * slope + 2 * p1 * y + 6 * p2 * x);
    to.u_y = fx * cross, to.v_x = fy * cross;
    to.v_y = fy * (radial + y * y * slope + 6 * p1 * y + 2 * p2 * x);
  }

  /// Pixel of a point in this device's frame; the point has z > 0.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& point) const;
  /// Pixel of a normalised, undistorted direction (x/z, y/z).
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;
  /// Derivative of distort(): pixels per unit of the normalised direction.
  [[nodiscard]] Eigen::Matrix2d distort_jacobian(const Eigen::Vector2d& normalised) const;
  /// Normalised, undistorted direction of a pixel: Newton's method to 1e-12.
  [[nodiscard]] Eigen::Vector2d undistort(const Eigen::Vector2d& pixel) const;
  /// Tells whether the distortion can be inverted everywhere in the image.
  [[nodiscard]] bool invertible() const;

  friend bool operator==(const Lens&, const Lens&) = default;
};

}  // namespace slsd
