// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/tie.hpp"

namespace slsd {

/// All points of a board in the order of their ids.
using GridOrder = std::vector<Eigen::Vector2d>;

/// Possible numberings of a grid of points in rows of the board's columns, starting at any of its corners; for square
/// boards also by columns.
/// @param pixels  Board::point_count() points, row by row from any corner
/// @return        the numberings that show the board from the front; first the one whose rows run most to the right in
/// the image
/// @thread reentrant
[[nodiscard]] std::vector<GridOrder> grid_orders(std::span<const Eigen::Vector2d> pixels, const Board& board);

/// The ties of a point and of those up to `steps` rows and columns away.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_around(const GridOrder& order, const Board& board, int id, int steps);

/// All ties.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_of(const GridOrder& order, const Board& board);

}  // namespace slsd
