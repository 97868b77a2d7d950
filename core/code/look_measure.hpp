// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/code/symbol_look.hpp"

namespace slsd {

/// Where the symbol is that is to be measured.
struct LookGeometry {
  Eigen::Vector2d middle_px;            ///< of its square, in the image
  Eigen::Matrix2d camera_from_pattern;  ///< as it is: tells whether a region left its cell
  Eigen::Matrix2d assumed;              ///< as the decoder believes: what the features are measured by
  double threshold;                     ///< 0 to 1, what is taken for lit
  const LookOptions& options;
};

/// Finds the symbol's region by the threshold and measures it through a soft threshold, a ramp from 20 to 80 %.
/// @param light  0 dark to 1 lit
/// @return       empty where the region reaches over its cell, or lit pixels of the cell are not part of it
/// @thread reentrant
[[nodiscard]] std::optional<LookFeatures> measure_look(const Image<double>& light, const LookGeometry& geometry);

}  // namespace slsd
