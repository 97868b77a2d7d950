// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/lattice_frame.hpp"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace slsd {
namespace {

/// Projector pixel that lights what the camera sees at a pixel, on a plane z = depth of the camera.
Eigen::Vector2d projector_pixel(const CalibratedCamera& camera, const Lens& projector, double x, double y,
                                double depth_mm) {
  const Eigen::Vector2d direction = camera.lens.undistort({x, y});
  return projector.project(camera.projector_from_camera *
                           Eigen::Vector3d(direction.x() * depth_mm, direction.y() * depth_mm, depth_mm));
}

}  // namespace

template <class ProjectorPixelAt>
void ExpectedFrames::differentiate(const ProjectorPixelAt& projector_pixel_at) {
  constexpr double kStep = 2;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const double x = (column + 0.5) * kSpacingPx, y = (row + 0.5) * kSpacingPx;
      Eigen::Matrix2d projector_from_camera;
      projector_from_camera.col(0) =
          (projector_pixel_at(x + kStep, y) - projector_pixel_at(x - kStep, y)) / (2 * kStep);
      projector_from_camera.col(1) =
          (projector_pixel_at(x, y + kStep) - projector_pixel_at(x, y - kStep)) / (2 * kStep);
      frames_.push_back({projector_from_camera.inverse().cast<float>(), projector_from_camera.cast<float>(),
                         static_cast<float>(1 / std::sqrt(std::abs(projector_from_camera.determinant())))});
    }
  }
}

ExpectedFrames::ExpectedFrames(const CalibratedCamera& camera, const Lens& projector, double depth_mm)
    : columns_(frames_along(camera.lens.width_px)), rows_(frames_along(camera.lens.height_px)) {
  differentiate([&](double x, double y) { return projector_pixel(camera, projector, x, y, depth_mm); });
}

ExpectedFrames::ExpectedFrames(const Eigen::Matrix3d& camera_from_projector, int camera_width_px, int camera_height_px)
    : columns_(frames_along(camera_width_px)), rows_(frames_along(camera_height_px)) {
  const Eigen::Matrix3d projector_from_camera = camera_from_projector.inverse();
  differentiate([&](double x, double y) -> Eigen::Vector2d {
    return (projector_from_camera * Eigen::Vector3d(x, y, 1)).hnormalized();
  });
}

}  // namespace slsd
