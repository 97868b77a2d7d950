// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for a ChArUco board: markers; corners foretold by the markers around each, each corner fitted; then
/// corners foretold by those found, where markers were not read.
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_charuco(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
