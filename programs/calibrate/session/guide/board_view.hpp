// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/board/find_board.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {

/// Each camera's sighting of the board, or the reason why it sees none.
using BoardSightings = std::vector<Result<BoardSighting>>;

/// The views of all cameras at one moment, one entry for each camera.
struct BoardView {
  std::vector<GreyImage> pictures;
  BoardSightings sightings;
};

/// @thread reentrant
[[nodiscard]] BoardView look_for_board(std::vector<GreyImage> pictures, const Board& board);

/// Tells whether any camera sees the board.
[[nodiscard]] bool is_seen(const BoardSightings& sightings);

/// The movement of the board's points in the image: root mean square over the points seen both times, in the camera
/// with the largest movement.
/// @return px; infinite if no camera sees the board both times
/// @thread reentrant
[[nodiscard]] double moved_px(const BoardSightings& before, const BoardSightings& after);

}  // namespace slsd
