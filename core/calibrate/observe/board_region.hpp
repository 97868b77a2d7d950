// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/board/find_board.hpp"
#include "core/geometry/homography.hpp"
#include "core/image.hpp"

namespace slsd {

/// Of the pixels of a board's print, those at the level of a saturated one: also where a reflection leaves no point of
/// it.
/// @return 0 to 1
/// @thread reentrant
[[nodiscard]] double full_share_of_print(const GreyView& image, const Board& board, const BoardSighting& sighting);

/// Where the board is in an image: what the projector lights elsewhere is not on its plane.
/// @thread reentrant
class BoardRegion {
 public:
  BoardRegion(const Board& board, const BoardSighting& sighting);

  /// Whether a pixel lies on what is printed, or on the white border that has to be around it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& camera_px) const;
  /// Whether a symbol that lies on the board may reach there.
  [[nodiscard]] bool is_near(const Eigen::Vector2d& camera_px) const;
  /// Whether it lies on what is printed.
  [[nodiscard]] bool is_printed(const Eigen::Vector2d& camera_px) const;

 private:
  [[nodiscard]] bool is_within(double margin_mm, const Eigen::Vector2d& camera_px) const;

  Homography board_from_camera_;
  Eigen::Vector2d size_mm_;
  double border_mm_, near_mm_;
};

}  // namespace slsd
