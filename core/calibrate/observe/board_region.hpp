// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/board/find_board.hpp"
#include "core/geometry/homography.hpp"
#include "core/image.hpp"

namespace slsd {

/// Share of the saturated pixels of a board's print, even if a reflection hides all its points.
/// @return 0 to 1
/// @thread reentrant
[[nodiscard]] double full_share_of_print(const GreyView& image, const Board& board, const BoardSighting& sighting);

/// Region of the board in an image: light of the projector outside it is not on the board's plane.
/// @thread reentrant
class BoardRegion {
 public:
  BoardRegion(const Board& board, const BoardSighting& sighting);

  /// Tells whether a pixel lies on the print, or on the required white border around it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& camera_px) const;
  /// Tells whether a symbol on the board may reach this pixel.
  [[nodiscard]] bool is_near(const Eigen::Vector2d& camera_px) const;
  /// Tells whether a pixel lies on the print.
  [[nodiscard]] bool is_printed(const Eigen::Vector2d& camera_px) const;

 private:
  [[nodiscard]] bool is_within(double margin_mm, const Eigen::Vector2d& camera_px) const;

  Homography board_from_camera_;
  Eigen::Vector2d size_mm_;
  double border_mm_, near_mm_;
};

}  // namespace slsd
