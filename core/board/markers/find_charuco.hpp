// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"
#include "core/result.hpp"

namespace slsd {

/// find_board() for a ChArUco board. It finds the markers, and fits each corner at the place that nearby markers
/// predict. Where no markers were read, it fits corners at the places that found corners predict.
/// @errors as find_board()
/// @thread reentrant
[[nodiscard]] Result<BoardSighting> find_charuco(const BoardPhoto& photo, const Board& board);

}  // namespace slsd
