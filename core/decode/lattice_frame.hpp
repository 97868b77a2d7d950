// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"

namespace slsd {

/// How the pattern lies in the camera's image around a symbol: the camera's steps for one projector pixel to the right
/// (first column) and one down (second column).
using LatticeFrame = Eigen::Matrix2f;

/// The frames that the calibration lets one expect: those of a surface that faces the camera in the middle of the
/// working range. They hardly depend on the depth; what turns them is the tilt of the surface.
/// @thread reentrant
class ExpectedFrames {
 public:
  ExpectedFrames(const CalibratedCamera& camera, const Lens& projector, double depth_mm);

  /// @param camera_px  inside the camera's image
  [[nodiscard]] const LatticeFrame& at(float x, float y) const;

  /// Camera pixels for one projector pixel, the smallest over the image.
  [[nodiscard]] float smallest_scale() const { return smallest_scale_; }
  /// The same in the middle of the image.
  [[nodiscard]] float middle_scale() const { return middle_scale_; }

 private:
  int columns_, rows_;
  float smallest_scale_, middle_scale_;
  std::vector<LatticeFrame> frames_;
};

}  // namespace slsd
