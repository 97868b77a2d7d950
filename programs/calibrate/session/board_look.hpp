// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/board/find_board.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// What each camera sees of the board, or why it sees none.
using BoardSightings = std::vector<Result<BoardSighting>>;

/// What the cameras see at one moment, one entry to a camera.
struct BoardLook {
  std::vector<GreyImage> pictures;
  BoardSightings sightings;
};

/// @thread reentrant
[[nodiscard]] BoardLook look_for_board(std::vector<GreyImage> pictures, const Board& board);

/// Whether any camera sees the board.
[[nodiscard]] bool is_seen(const BoardSightings& sightings);

/// How far the board's points moved in the image: root mean square over the points seen both times, in the camera where
/// they moved most.
/// @return px; infinite where no camera sees the board both times
/// @thread reentrant
[[nodiscard]] double moved_px(const BoardSightings& before, const BoardSightings& after);

}  // namespace slsd
