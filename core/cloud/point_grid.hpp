// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// An organised cloud: a value for each camera pixel, row by row, several cameras one below the other. A pixel without
/// a point has NaN in its point and sigma, and intensity 0.
struct PointGrid {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> points_mm;  ///< rig frame
  std::vector<float> sigma_mm;             ///< one standard deviation along the camera's ray
  std::vector<std::uint8_t> intensity;
  std::vector<std::uint8_t> camera;  ///< index in the calibration
  std::vector<Rgb> colours;          ///< empty: the cloud has none

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

}  // namespace slsd
