// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/board/board.hpp"
#include "core/board/board_photo.hpp"
#include "core/board/board_sighting.hpp"

namespace slsd {

/// A point of a board with its measurements.
struct MeasuredPoint {
  SeenPoint point;
  double step = 0;     ///< white minus black, levels
  double blur_px = 0;  ///< one standard deviation
};

/// Summarises points as a sighting, sorted by id.
/// @param points  at least one
/// @thread reentrant
[[nodiscard]] BoardSighting summarise(std::vector<MeasuredPoint> points, const BoardPhoto& photo, const Board& board);

/// Tells whether there are at least `least` points that span the plane: not all in one row or one column.
/// @thread reentrant
[[nodiscard]] bool span_a_plane(const std::vector<MeasuredPoint>& points, const Board& board, std::size_t least);

}  // namespace slsd
