// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/board/tie.hpp"

namespace slsd {

/// Points of a board in the order of their ids, all of them.
using GridOrder = std::vector<Eigen::Vector2d>;

/// The ways in which a grid of points may be numbered in rows of the board's columns: begun at any of its corners, and
/// by columns where the board is square.
/// @param pixels  Board::point_count() points, row by row from any corner
/// @return        those in which the board is seen from the front; first that whose rows run most to the right in the
/// image
/// @thread reentrant
[[nodiscard]] std::vector<GridOrder> grid_orders(std::span<const Eigen::Vector2d> pixels, const Board& board);

/// The ties of a point and those up to `steps` rows and columns from it.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_around(const GridOrder& order, const Board& board, int id, int steps);

/// All ties.
/// @thread reentrant
[[nodiscard]] std::vector<Tie> ties_of(const GridOrder& order, const Board& board);

}  // namespace slsd
