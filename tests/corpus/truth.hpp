// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/result.hpp"

namespace slsd {

/// The surface around the middle of a symbol's square, as the camera sees it.
struct SurfaceTruth {
  Eigen::Vector2d middle_px;       ///< in the camera
  double z_mm;                     ///< depth at the middle
  Eigen::Vector2d gradient_mm_px;  ///< of the depth, along the camera's u and v

  /// Depth at another pixel nearby. On a plane 1/z is linear in the pixel, so this is exact there.
  [[nodiscard]] double depth_mm(const Eigen::Vector2d& pixel) const;
};

/// What the renderer knows of one cell of the pattern; of cells that the camera does not see there is none.
struct CellTruth {
  int column, row;
  Eigen::Vector2d top_left_px, bottom_right_px;  ///< box around what the camera sees of the symbol
  std::optional<SurfaceTruth> surface;           ///< where the symbol is seen whole and the surface is smooth
  bool resolvable;  ///< at least 95 % of the symbol seen, and 8 camera px in the direction most compressed

  /// Whether a symbol seen there can be this cell's.
  [[nodiscard]] bool covers(const Eigen::Vector2d& pixel) const;
};

/// Reads a scene's truth.csv (columns in README.md).
/// @errors kMalformed with the line
[[nodiscard]] Result<std::vector<CellTruth>> read_truth(std::string_view text, std::string_view name);

}  // namespace slsd
