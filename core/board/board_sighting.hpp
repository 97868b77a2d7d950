// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

namespace slsd {

/// A point of a board in an image.
struct SeenPoint {
  int id = 0;             ///< Board::point(id) is its position on the board
  Eigen::Vector2d pixel;  ///< distorted, sub-pixel, the first pixel's centre at (0, 0)
};

/// A board in an image. Lengths and shares are medians over the points.
struct BoardSighting {
  std::vector<SeenPoint> points;     ///< ascending ids, at least 4 points and not all on a line
  double contrast = 0;               ///< white minus black at the points, as a share of the image's full level; 0 to 1
  double edge_px = 0;                ///< one standard deviation of the blur at the board's edges; a sharp image has 0.3
                                     ///< to 0.8
  double pitch_px = 0;               ///< Board::pitch_mm in the image, along the shorter direction
  double clipped_share = 0;          ///< share of the board's pixels at the full level or at 0; 0 to 1
  double full_share = 0;             ///< share of the same pixels at the full level: 0 to 1. Ink may be at 0
  bool half_turn_ambiguous = false;  ///< the board looks the same upside down (chessboard of 9x7 inner corners, circles
                                     ///< of even rows); its upper end is then assumed to be up in the image
};

}  // namespace slsd
