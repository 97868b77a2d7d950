// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

namespace slsd {

/// A symbol of known cell: a projector pixel, and the camera pixel that sees its light.
struct SymbolMatch {
  Eigen::Vector2d camera_px;     ///< distorted, as in the frame
  Eigen::Vector2d projector_px;  ///< distorted, in the projector's image
  double sigma_px;               ///< one standard deviation of the camera pixel in x and in y
};

}  // namespace slsd
