// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_sighting.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Finds a board and its points. For charuco and plane boards a part is enough; a chessboard and circles must be whole.
/// A corner is the best fit of a blurred, unevenly lit chessboard corner to the image: bias below 0.02 px. (OpenCV
/// 4.6's interpolateCornersCharuco is not used: its corners are off by half a pixel.) Centres are those of the discs,
/// not of the ellipses in the image, which perspective displaces.
/// @param image  8 or 16 bits grey, at least 16 px wide and high
/// @errors kNotFound (the board is not visible, or too little of it, or it is cut off), kMismatch (another board:
///         markers of another dictionary or with unknown ids, another number of corners, another layout, the legacy
///         layout; or it is mirrored), kInvalidArgument (the image is too small)
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_board(const GreyView& image, const Board& board);

}  // namespace slsd
