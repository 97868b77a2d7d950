// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/lens.hpp"

#include <cmath>

#include <Eigen/LU>

namespace slsd {
namespace {

constexpr int kMaxSteps = 50;
constexpr int kMaxHalvings = 20;

// The samples are so dense that a distortion of five coefficients cannot fold between two of them.
constexpr int kSamplesAcross = 32;
constexpr int kSamplesAlongRay = 16;

// Whether the distortion does not fold between the optical axis and this direction.
bool unfolded(const Lens& lens, const Eigen::Vector2d& normalised) {
  for (int i = 0; i <= kSamplesAlongRay; ++i) {
    const double share = static_cast<double>(i) / kSamplesAlongRay;
    if (!(lens.distort_jacobian(share * normalised).determinant() > 0.0)) return false;
  }
  return true;
}

/// One step of Newton's method from an estimate of lens.undistort(pixel).
Eigen::Vector2d refine(const Lens& lens, const Eigen::Vector2d& estimate, const Eigen::Vector2d& pixel) {
  return estimate - lens.distort_jacobian(estimate).inverse() * (lens.distort(estimate) - pixel);
}

bool invertible_at(const Lens& lens, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d normalised = lens.undistort(pixel);
  return (lens.distort(normalised) - pixel).norm() < 1e-6 && unfolded(lens, normalised);
}

}  // namespace

Eigen::Vector2d Lens::project(const Eigen::Vector3d& point) const {
  return distort(Eigen::Vector2d(point.x() / point.z(), point.y() / point.z()));
}

Eigen::Vector2d Lens::distort(const Eigen::Vector2d& normalised) const {
  View<double> seen;
  view(normalised.x(), normalised.y(), seen);
  return {seen.u, seen.v};
}

Eigen::Matrix2d Lens::distort_jacobian(const Eigen::Vector2d& normalised) const {
  View<double> seen;
  view(normalised.x(), normalised.y(), seen);
  Eigen::Matrix2d jacobian;
  jacobian << seen.u_x, seen.u_y, seen.v_x, seen.v_y;
  return jacobian;
}

Eigen::Vector2d Lens::undistort(const Eigen::Vector2d& pixel) const {
  Eigen::Vector2d estimate((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  double error = (distort(estimate) - pixel).norm();
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Vector2d next = refine(*this, estimate, pixel);
    double next_error = (distort(next) - pixel).norm();
    for (int i = 0; i < kMaxHalvings && !(next_error <= error); ++i) {
      next = 0.5 * (next + estimate);
      next_error = (distort(next) - pixel).norm();
    }
    if (!(next_error < error)) break;
    const double moved = (next - estimate).norm();
    estimate = next;
    error = next_error;
    if (moved < 1e-13) break;
  }
  return estimate;
}

bool Lens::invertible() const {
  for (int row = 0; row <= kSamplesAcross; ++row) {
    for (int column = 0; column <= kSamplesAcross; ++column) {
      const Eigen::Vector2d pixel(column * width_px / static_cast<double>(kSamplesAcross) - 0.5,
                                  row * height_px / static_cast<double>(kSamplesAcross) - 0.5);
      if (!invertible_at(*this, pixel)) return false;
    }
  }
  return true;
}

}  // namespace slsd
