// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// Local frame of the pattern in the camera's image around a symbol: the camera's steps for one projector pixel to the
/// right (first column) and one down (second column).
using LatticeFrame = Eigen::Matrix2f;

/// A frame and what follows from it.
struct ExpectedFrame {
  LatticeFrame frame;
  Eigen::Matrix2f inverse;  ///< projector px for one camera px
  float scale;              ///< camera px for one projector px, geometric mean of both axes
};

/// Local frames that the calibration predicts for a surface that faces the camera in the middle of the working range.
/// They hardly depend on the depth; the tilt of the surface changes them.
/// @thread reentrant
class ExpectedFrames {
 public:
  ExpectedFrames(const CalibratedCamera& camera, const Lens& projector, double depth_mm);

  /// Makes the frames of a plane from its homography.
  /// @param camera_from_projector  maps homogeneous projector px to camera px
  ExpectedFrames(const Eigen::Matrix3d& camera_from_projector, int camera_width_px, int camera_height_px);

  /// @param camera_px  inside the camera's image
  [[nodiscard]] const ExpectedFrame& at(float x, float y) const {
    const int column = std::clamp(static_cast<int>(x / kSpacingPx), 0, columns_ - 1),
              row = std::clamp(static_cast<int>(y / kSpacingPx), 0, rows_ - 1);
    return frames_[static_cast<std::size_t>(row) * columns_ + column];
  }
  [[nodiscard]] const ExpectedFrame& in_the_middle() const {
    return frames_[static_cast<std::size_t>(rows_ / 2) * columns_ + columns_ / 2];
  }

 private:
  static constexpr int kSpacingPx = 64;
  static constexpr int frames_along(int length_px) { return (length_px + kSpacingPx - 1) / kSpacingPx; }
  template <class ProjectorPixelAt>
  void differentiate(const ProjectorPixelAt& projector_pixel_at);

  int columns_, rows_;
  std::vector<ExpectedFrame> frames_;
};

}  // namespace slsd
