// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for a chessboard: OpenCV's search, in the image reduced first; then each corner fitted. The top left
/// square is black, which tells the board's upper end; where its opposite is black too, the end that is up in the image
/// is taken.
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_chessboard(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
