// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// One point of a dense cloud, in the rig's frame.
struct DensePoint {
  Eigen::Vector3f place_mm;
  float sigma_mm = 0;  ///< one standard deviation along the camera's ray
  std::uint8_t intensity = 0;
  std::uint8_t camera = 0;  ///< index in the calibration
  bool coloured = false;    ///< the cloud has colours
  Rgb colour{};
};

/// Reads a dense cloud as slsd writes it: docs/formats.md, PLY.
/// @errors kMalformed: no such file, or cut; kUnsupported: a point for each symbol, or points in the robot's base
/// @thread reentrant
[[nodiscard]] Result<std::vector<DensePoint>> read_dense_ply(std::string_view bytes);

}  // namespace slsd
