// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for a chessboard: OpenCV's search, first in a reduced image; then a fit of each corner. The top left
/// square is black, which shows the board's upper end. If the opposite corner is also black, the end that is up in the
/// image counts as upper.
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_chessboard(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
