// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

namespace slsd {

/// A symbol whose cell is known: where the camera sees what the projector pixel lights.
struct SymbolMatch {
  Eigen::Vector2d camera_px;     ///< distorted, as seen
  Eigen::Vector2d projector_px;  ///< the same of the projector
  double sigma_px;               ///< one standard deviation of the camera pixel in x and in y
};

}  // namespace slsd
