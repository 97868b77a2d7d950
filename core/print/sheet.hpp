// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/print/paper.hpp"
#include "core/result.hpp"

namespace slsd {

/// A board on a sheet of paper:
///
///     +------------------------------+
///     |   |                          |   rulers begin at the board's origin, on whose sides
///     | r |   +------------------+   |   they are, and end with the board
///     | u |   |                  |   |
///     | l |   |      board       |   |
///     | e |   |                  |   |
///     | r |   +------------------+   |
///     |       ------- ruler -------  |
///     |       the board, in words    |
///     +------------------------------+
struct Sheet {
  Board board;
  Paper paper;
  Eigen::Vector2d origin_mm = Eigen::Vector2d::Zero();  ///< origin of the board's frame, from the paper's top left
  double clear_mm = 0;                                  ///< width of white between the board and the rulers
};

/// Lays a board out on paper in the orientation that fits, always true to scale.
/// @errors kImpossible: it does not fit; the message has both sizes, and a paper that fits
/// @thread reentrant
[[nodiscard]] Result<Sheet> lay_out(const Board& board, const Paper& paper);

/// The ChArUco board of 11 x 7 squares with whole millimetres that fills a sheet.
/// @errors kImpossible: the paper is too small for squares of 5 mm
/// @thread reentrant
[[nodiscard]] Result<Board> board_for(const Paper& paper);

}  // namespace slsd
