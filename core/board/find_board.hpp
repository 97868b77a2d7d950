// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_sighting.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

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
