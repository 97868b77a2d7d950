// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// A point of a board in an image.
struct SeenPoint {
  int id = 0;             ///< Board::point(id) is where it is on the board
  Eigen::Vector2d pixel;  ///< distorted, sub-pixel, the first pixel's centre at (0, 0)
};

/// A board in an image. Lengths and shares are medians over the points.
struct BoardSighting {
  std::vector<SeenPoint> points;     ///< by ascending id, at least 4 and not all on a line
  double contrast = 0;               ///< white less black at the points, of the image's full level; 0 to 1
  double edge_px = 0;                ///< one standard deviation of the blur at the board's edges; sharp: 0.3 to 0.8
  double pitch_px = 0;               ///< Board::pitch_mm in the image, along the shorter direction
  double clipped_share = 0;          ///< of the pixels where the board is, those at the full level or at 0; 0 to 1
  double full_share = 0;             ///< of the same pixels, those at the full level: 0 to 1. Ink may well be at 0
  bool half_turn_ambiguous = false;  ///< the board looks the same upside down (chessboard of 9x7 inner corners, circles
                                     ///< of even rows), so that its upper end was taken to be up in the image
};

/// Finds a board and its points. Of charuco and plane boards a part is enough; a chessboard and circles must be whole.
/// Corners are where a chessboard's corner, blurred and unevenly lit, fits the image best: bias below 0.02 px. (The
/// corners of OpenCV 4.6's interpolateCornersCharuco are not used: they are off by half a pixel.) The centres of discs
/// are those of the discs, not of the ellipses in the image, which perspective moves.
/// @param image  grey of 8 or 16 bits, at least 16 px wide and high
/// @errors kNotFound (nothing of this board is seen, or too little, or it is cut off), kMismatch (another board is
/// seen:
///         markers of another dictionary or of ids that it has not, another number of corners, another layout, the
///         legacy layout; or it is mirrored), kInvalidArgument (the image is too small)
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_board(const GreyView& image, const Board& board);

}  // namespace slsd
