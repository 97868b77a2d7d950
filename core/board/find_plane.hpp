// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for the reference plane: finds markers, and fits the four straight edges of each.
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_plane(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
