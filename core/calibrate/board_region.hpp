// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/board/find_board.hpp"
#include "core/geometry/homography.hpp"

namespace slsd {

/// Where the board is in an image: what the projector lights elsewhere is not on its plane.
/// @thread reentrant
class BoardRegion {
 public:
  BoardRegion(const Board& board, const BoardSighting& sighting);

  /// Whether a pixel lies on what is printed, or on the white border that has to be around it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& camera_px) const;

 private:
  Homography board_from_camera_;
  Eigen::Vector2d low_mm_, high_mm_;
};

}  // namespace slsd
