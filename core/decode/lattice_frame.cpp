// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/lattice_frame.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace slsd {
namespace {

constexpr int kSpacingPx = 64;

/// Projector pixel that lights what the camera sees at a pixel, on a plane z = depth of the camera.
Eigen::Vector2d projector_pixel(const CalibratedCamera& camera, const Lens& projector, double x, double y,
                                double depth_mm) {
  const Eigen::Vector2d direction = camera.lens.undistort({x, y});
  return projector.project(camera.projector_from_camera *
                           Eigen::Vector3d(direction.x() * depth_mm, direction.y() * depth_mm, depth_mm));
}

ExpectedFrame frame_at(const CalibratedCamera& camera, const Lens& projector, double x, double y, double depth_mm) {
  constexpr double kStep = 2;
  Eigen::Matrix2d projector_from_camera;
  projector_from_camera.col(0) = (projector_pixel(camera, projector, x + kStep, y, depth_mm) -
                                  projector_pixel(camera, projector, x - kStep, y, depth_mm)) /
                                 (2 * kStep);
  projector_from_camera.col(1) = (projector_pixel(camera, projector, x, y + kStep, depth_mm) -
                                  projector_pixel(camera, projector, x, y - kStep, depth_mm)) /
                                 (2 * kStep);
  return {projector_from_camera.inverse().cast<float>(), projector_from_camera.cast<float>(),
          static_cast<float>(1 / std::sqrt(std::abs(projector_from_camera.determinant())))};
}

}  // namespace

ExpectedFrames::ExpectedFrames(const CalibratedCamera& camera, const Lens& projector, double depth_mm)
    : columns_((camera.lens.width_px + kSpacingPx - 1) / kSpacingPx),
      rows_((camera.lens.height_px + kSpacingPx - 1) / kSpacingPx) {
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      frames_.push_back(frame_at(camera, projector, (column + 0.5) * kSpacingPx, (row + 0.5) * kSpacingPx, depth_mm));
    }
  }
}

const ExpectedFrame& ExpectedFrames::at(float x, float y) const {
  const int column = std::clamp(static_cast<int>(x) / kSpacingPx, 0, columns_ - 1);
  const int row = std::clamp(static_cast<int>(y) / kSpacingPx, 0, rows_ - 1);
  return frames_[static_cast<std::size_t>(row) * columns_ + column];
}

}  // namespace slsd
